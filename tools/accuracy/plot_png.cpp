// The plot as PNG: draws what plot.cpp writes as SVG, and no other SVG.
#include <stb/stb_easy_font.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "image_file.h"
#include "report.h"

namespace rtc::lab {
namespace {

constexpr double kScale = 2;

class Canvas {
  public:
    Canvas(double width, double height) : picture_(uint32_t(width * kScale), uint32_t(height * kScale), 3) {
        std::fill(picture_.pixels.begin(), picture_.pixels.end(), 1.0f);
    }
    const tools::Picture& picture() const { return picture_; }

    void rectangle(double x, double y, double w, double h, const std::string& fill) {
        each(x, y, x + w, y + h, fill, [](double, double) { return 1.0; });
    }
    // One unit wide; `dashes` 4 on, 3 off along it.
    void line(double x0, double y0, double x1, double y1, const std::string& colour, bool dashes = false) {
        const double dx = x1 - x0, dy = y1 - y0, length = std::max(1e-9, std::hypot(dx, dy));
        each(std::min(x0, x1) - 1, std::min(y0, y1) - 1, std::max(x0, x1) + 1, std::max(y0, y1) + 1, colour, [&](double x, double y) {
            const double along = ((x - x0) * dx + (y - y0) * dy) / length;
            if (along < -0.5 || along > length + 0.5 || (dashes && std::fmod(along + 7, 7) > 4)) return 0.0;
            return 1.0 - std::fabs((x - x0) * dy - (y - y0) * dx) / length;
        });
    }
    void circle(double cx, double cy, double r, const std::string& fill, const std::string& stroke) {
        each(cx - r - 1, cy - r - 1, cx + r + 1, cy + r + 1, stroke, [&](double x, double y) { return r + 1 - std::hypot(x - cx, y - cy); });
        each(cx - r, cy - r, cx + r, cy + r, fill, [&](double x, double y) { return r - std::hypot(x - cx, y - cy); });
    }
    void text(double x, double y, const std::string& anchor, double size, std::string words) {
        static char quads[64 * 1024];
        const double scale = size / 12;  // the font's lines are 12 high, its letters 7
        const double width = stb_easy_font_width(words.data()) * scale;
        if (anchor == "middle") x -= width / 2;
        if (anchor == "end") x -= width;
        const int count = stb_easy_font_print(0, 0, words.data(), nullptr, quads, sizeof quads);
        for (int i = 0; i < count; ++i) {
            float corners[4][4];  // x, y, z, colour
            std::copy_n(quads + size_t(i) * sizeof corners, sizeof corners, reinterpret_cast<char*>(corners));
            rectangle(x + corners[0][0] * scale, y + (corners[0][1] - 8) * scale, (corners[2][0] - corners[0][0]) * scale,
                      (corners[2][1] - corners[0][1]) * scale, "#222");
        }
    }

  private:
    // Colours what lies in the box by `cover`, 0 to 1, of the pixels' centres.
    template <typename Cover>
    void each(double x0, double y0, double x1, double y1, const std::string& colour, Cover cover) {
        if (colour.size() < 4 || colour[0] != '#') return;  // none
        const bool brief = colour.size() == 4;
        float rgb[3];
        for (size_t i = 0; i < 3; ++i) {
            const std::string digits = brief ? std::string(2, colour[1 + i]) : colour.substr(1 + 2 * i, 2);
            rgb[i] = float(std::strtol(digits.c_str(), nullptr, 16)) / 255;
        }
        auto clamped = [](double v, uint32_t limit) { return uint32_t(std::clamp(std::round(v * kScale), 0.0, double(limit))); };
        for (uint32_t y = clamped(y0, picture_.height); y < clamped(y1, picture_.height); ++y)
            for (uint32_t x = clamped(x0, picture_.width); x < clamped(x1, picture_.width); ++x) {
                const float a = float(std::clamp(cover((x + 0.5) / kScale, (y + 0.5) / kScale), 0.0, 1.0));
                for (int i = 0; i < 3; ++i) picture_.at(x, y)[i] += (rgb[i] - picture_.at(x, y)[i]) * a;
            }
    }

    tools::Picture picture_;
};

std::string attribute(const std::string& element, const std::string& name) {
    const size_t at = element.find(" " + name + "=\"");
    if (at == std::string::npos) return "";
    const size_t begin = at + name.size() + 3;
    return element.substr(begin, element.find('"', begin) - begin);
}

double number(const std::string& element, const std::string& name) { return std::atof(attribute(element, name).c_str()); }

std::string plain(std::string text) {
    for (const auto& [entity, character] : {std::pair("&lt;", "<"), std::pair("&gt;", ">"), std::pair("&amp;", "&")})
        for (size_t at; (at = text.find(entity)) != std::string::npos;) text.replace(at, std::string(entity).size(), character);
    return text;
}

}  // namespace

void write_plot_png(const DeviceReport& report, const std::string& path) {
    const std::string svg = plot_svg(report);
    Canvas canvas(number(svg.substr(0, svg.find('>')), "width"), number(svg.substr(0, svg.find('>')), "height"));
    for (size_t at = svg.find('<', 1); at != std::string::npos; at = svg.find('<', at + 1)) {
        const size_t end = svg.find('>', at);
        const std::string e = svg.substr(at, end - at);
        const std::string kind = e.substr(1, e.find_first_of(" /", 1) - 1);
        if (kind == "rect") {
            const double x = number(e, "x"), y = number(e, "y"), w = number(e, "width"), h = number(e, "height");
            if (attribute(e, "width") == "100%") continue;  // the ground is white already
            canvas.rectangle(x, y, w, h, attribute(e, "fill"));
            const std::string stroke = attribute(e, "stroke");
            for (const double top : {y, y + h}) canvas.line(x, top, x + w, top, stroke);
            for (const double side : {x, x + w}) canvas.line(side, y, side, y + h, stroke);
        } else if (kind == "line") {
            canvas.line(number(e, "x1"), number(e, "y1"), number(e, "x2"), number(e, "y2"), attribute(e, "stroke"));
        } else if (kind == "circle") {
            canvas.circle(number(e, "cx"), number(e, "cy"), number(e, "r"), attribute(e, "fill"), attribute(e, "stroke"));
        } else if (kind == "path") {  // the arrow below a bound
            double x = 0, y = 0;
            std::sscanf(attribute(e, "d").c_str(), "M%lf %lf", &x, &y);
            const std::string stroke = attribute(e, "stroke");
            canvas.line(x, y, x, y + 10, stroke);
            canvas.line(x - 3, y + 6, x, y + 10, stroke);
            canvas.line(x, y + 10, x + 3, y + 6, stroke);
        } else if (kind == "polyline") {
            const std::string points = attribute(e, "points");
            double x0 = 0, y0 = 0, x1, y1;
            bool first = true;
            const char* p = points.c_str();
            for (int used = 0; std::sscanf(p, " %lf,%lf%n", &x1, &y1, &used) == 2; p += used, x0 = x1, y0 = y1, first = false)
                if (!first) canvas.line(x0, y0, x1, y1, attribute(e, "stroke"), true);
        } else if (kind == "text") {
            const std::string words = svg.substr(end + 1, svg.find('<', end) - end - 1);
            canvas.text(number(e, "x"), number(e, "y"), attribute(e, "text-anchor"), number(e, "font-size"), plain(words));
        }
    }
    tools::write_picture(path, canvas.picture(), false);
}

}  // namespace rtc::lab
