// The picture of a device's report: cost against error, on logarithmic axes, as SVG.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "report.h"

namespace rtc::lab {
namespace {

constexpr double kPanel = 300, kHeight = 250, kLeft = 62, kGap = 26, kTop = 54, kBottom = 44;

struct Mark {
    const Summary* subject;
    double x, y;   // cost in ns, error
    bool below;    // none was seen: y is a bound
};

struct Panel {
    const char* title;
    const char* unit;
    std::vector<Mark> marks;
};

std::string escaped(const std::string& text) {
    std::string out;
    for (char c : text) {
        if (c == '&') out += "&amp;";
        else if (c == '<') out += "&lt;";
        else if (c == '>') out += "&gt;";
        else out += c;
    }
    return out;
}

template <typename... Args>
void add(std::string& out, const char* pattern, Args... args) {
    char text[512];
    std::snprintf(text, sizeof text, pattern, args...);
    out += text;
}

void text(std::string& out, double x, double y, const char* anchor, int size, const std::string& words) {
    add(out, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\" font-size=\"%d\">", x, y, anchor, size);
    out += escaped(words) + "</text>\n";
}

const char* colour(const Summary& s) {
    if (s.name == "fast") return "#d95f02";
    if (s.name == "watertight") return "#1b9e77";
    if (s.name == "exact") return "#3949ab";
    if (s.name == "exact64") return "#7570b3";
    if (s.name == "contracted") return "#a6761d";
    return s.name == "native" ? "#e7298a" : "#555555";
}

std::string power(int exponent) {
    char label[16];
    if (exponent >= 0 && exponent <= 3) {
        std::snprintf(label, sizeof label, "%d", int(std::lround(std::pow(10, exponent))));
    } else {
        std::snprintf(label, sizeof label, "1e%d", exponent);
    }
    return label;
}

void draw(std::string& out, const Panel& panel, double left, double x_low, double x_high) {
    double y_low = 1e300, y_high = -1e300;
    for (const Mark& m : panel.marks) {
        y_low = std::min(y_low, m.y);
        y_high = std::max(y_high, m.y);
    }
    if (panel.marks.empty()) y_low = y_high = 1;
    const int first = int(std::floor(std::log10(y_low) - 0.15)), last = int(std::ceil(std::log10(y_high) + 0.45));
    auto at_x = [&](double v) { return left + kPanel * std::log(v / x_low) / std::log(x_high / x_low); };
    auto at_y = [&](double v) { return kTop + kHeight * (double(last) - std::log10(v)) / double(last - first); };
    add(out, "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"#fafafa\" stroke=\"#999\"/>\n", left, kTop,
        kPanel, kHeight);
    for (int e = first; e <= last; ++e) {
        const double y = at_y(std::pow(10, e));
        add(out, "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#ddd\"/>\n", left, y, left + kPanel, y);
        text(out, left - 4, y + 3, "end", 9, power(e));
    }
    for (double decade = std::pow(10, std::floor(std::log10(x_low))); decade <= x_high; decade *= 10)
        for (double step : {1.0, 2.0, 5.0}) {
            const double x = decade * step;
            if (x < x_low || x > x_high) continue;
            add(out, "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#ddd\"/>\n", at_x(x), kTop, at_x(x),
                kTop + kHeight);
            char label[24];
            std::snprintf(label, sizeof label, "%g", x);
            text(out, at_x(x), kTop + kHeight + 13, "middle", 9, label);
        }
    text(out, left + kPanel / 2, kTop - 8, "middle", 11, panel.title);
    text(out, left + kPanel / 2, kTop + kHeight + 30, "middle", 10, "ns a ray");
    text(out, left - 44, kTop - 8, "start", 9, panel.unit);
    // What nobody beats: steps from cheap to good.
    std::vector<Mark> front = panel.marks;
    std::sort(front.begin(), front.end(), [](const Mark& a, const Mark& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
    double best = 1e300;
    std::string line;
    for (const Mark& m : front) {
        if (m.y >= best) continue;
        if (!line.empty()) add(line, " %.1f,%.1f", at_x(m.x), at_y(best));
        add(line, " %.1f,%.1f", at_x(m.x), at_y(m.y));
        best = m.y;
    }
    if (!line.empty()) {
        add(line, " %.1f,%.1f", left + kPanel, at_y(best));
        out += "<polyline fill=\"none\" stroke=\"#bbb\" stroke-dasharray=\"4 3\" points=\"" + line.substr(1) + "\"/>\n";
    }
    std::vector<std::pair<double, double>> labels;
    for (const Mark& m : front) {
        const double x = at_x(m.x), y = at_y(m.y);
        add(out, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"4\" stroke=\"%s\" fill=\"%s\"/>\n", x, y, colour(*m.subject),
            m.below ? "#ffffff" : colour(*m.subject));
        if (m.below)
            add(out, "<path d=\"M%.1f %.1fv10m-3 -4l3 4l3 -4\" fill=\"none\" stroke=\"%s\"/>\n", x, y + 4, colour(*m.subject));
        // Away from the labels already there.
        double at = y - 7;
        for (bool moved = true; moved;) {
            moved = false;
            for (const auto& [lx, ly] : labels)
                if (std::fabs(lx - x) < 62 && std::fabs(ly - at) < 10) {
                    at = ly - 10.5;
                    moved = true;
                }
        }
        labels.push_back({x, at});
        const bool right = x > left + kPanel - 60;
        text(out, right ? x + 4 : x - 4, at, right ? "end" : "start", 10, m.subject->name);
    }
}

}  // namespace

std::string plot_svg(const DeviceReport& report) {
    Panel leaks{"unbalanced rays, aimed at edges and vertices", "of all", {}};
    Panel hits{"first hits other than exact arithmetic's", "of all", {}};
    Panel ts{"error of t, 99.9 % are below", "ulp", {}};
    double x_low = 1e300, x_high = 0;
    for (const Summary& s : report.subjects) {
        if (s.nanoseconds <= 0) continue;
        x_low = std::min(x_low, s.nanoseconds);
        x_high = std::max(x_high, s.nanoseconds);
        auto mark = [&](Panel& panel, const Rate& rate) {
            if (rate.measured())
                panel.marks.push_back({&s, s.nanoseconds, rate.events ? rate.rate() : rate.bound(), rate.events == 0});
        };
        mark(leaks, s.aimed());
        mark(hits, s.first_hits);
        if (s.has_t) ts.marks.push_back({&s, s.nanoseconds, std::clamp(s.t_p999, 0.01, 64.0), false});
    }
    if (x_high == 0) x_low = x_high = 1;
    x_low /= 1.3;
    x_high *= 1.3;
    std::string out;
    const double width = 3 * (kPanel + kLeft) + kGap;
    add(out, "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" viewBox=\"0 0 %.0f %.0f\" "
        "font-family=\"sans-serif\" fill=\"#222\">\n", width, kTop + kHeight + kBottom, width, kTop + kHeight + kBottom);
    add(out, "<rect width=\"100%%\" height=\"100%%\" fill=\"#ffffff\"/>\n");
    text(out, 10, 20, "start", 13, report.device);
    text(out, width - 10, 20, "end", 10, "hollow with an arrow: none seen, drawn at the 95 % bound");
    double left = kLeft;
    for (const Panel* panel : {&leaks, &hits, &ts}) {
        draw(out, *panel, left, x_low, x_high);
        left += kPanel + kLeft;
    }
    return out + "</svg>\n";
}

}  // namespace rtc::lab
