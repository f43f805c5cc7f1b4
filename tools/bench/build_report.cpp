#include "build_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "bench_device.h"

namespace rtc::bench {
namespace {

std::string format(const char* pattern, double value) {
    char text[64];
    std::snprintf(text, sizeof text, pattern, value);
    return text;
}

const BuildRow* find(const BuildReport& report, const BuildRow& like, const std::string& by) {
    for (const BuildRow& row : report.rows)
        if (row.mesh == like.mesh && row.mode == like.mode && row.primitives == like.primitives &&
            row.top == like.top && row.by == by && !row.times.empty())
            return &row;
    return nullptr;
}

std::vector<std::string> peers_of(const BuildReport& report) {
    std::vector<std::string> peers;
    for (const BuildRow& row : report.rows)
        if (row.by != "rtc" && std::find(peers.begin(), peers.end(), row.by) == peers.end()) peers.push_back(row.by);
    return peers;
}

}  // namespace

double BuildRow::median() const { return median_of(times); }

double BuildRow::rate() const { return times.empty() ? 0 : double(primitives) / median(); }

std::string build_table(const BuildReport& report) {
    const std::vector<std::string> peers = peers_of(report);
    std::string text = "| mesh | primitives | mode | by | ms | M/s |", line = "| --- | --- | --- | --- | --- | --- |";
    for (const std::string& peer : peers) {
        text += " against " + peer + " |";
        line += " --- |";
    }
    text += " bytes each | compacted | scratch |\n" + line + " --- | --- | --- |\n";
    for (const BuildRow& row : report.rows) {
        text += "| " + row.mesh + (row.top ? ", top level" : "") + " | " + std::to_string(row.primitives) + " | " +
                row.mode + " | " + row.by + " | ";
        if (row.times.empty()) {
            text += row.error + " |\n";
            continue;
        }
        text += format("%.3f", 1e3 * row.median()) + " | " + format("%.1f", row.rate() * 1e-6) + " |";
        for (const std::string& peer : peers) {
            const BuildRow* other = row.by == peer ? nullptr : find(report, row, peer);
            text += other ? " " + format("%.2f", row.rate() / other->rate()) + " |" : " |";
        }
        const double count = double(row.primitives);
        text += " " + format("%.1f", row.bytes / count) + " |" +
                (row.compacted > 0 ? " " + format("%.1f", row.compacted / count) : "") + " | " +
                format("%.1f", row.scratch / count) + " |\n";
    }
    return text;
}

nlohmann::ordered_json as_json(const BuildReport& report) {
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const BuildRow& row : report.rows) {
        nlohmann::ordered_json entry{{"mesh", row.mesh}, {"primitives", row.primitives}, {"top", row.top},
                                     {"mode", row.mode}, {"by", row.by}};
        if (!row.error.empty()) entry["error"] = row.error;
        if (!row.times.empty()) {
            std::vector<double> times;
            for (double time : row.times) times.push_back(1e3 * time);
            entry["median_ms"] = 1e3 * row.median();
            entry["times_ms"] = times;
            entry["bytes"] = row.bytes;
            entry["compacted_bytes"] = row.compacted;
            entry["scratch_bytes"] = row.scratch;
        }
        rows.push_back(entry);
    }
    return {{"device", report.device}, {"rows", rows}};
}

std::string build_plot(const BuildReport& report, const std::string& mesh) {
    std::map<std::string, std::vector<std::pair<double, double>>> lines;
    double low_x = 1e30, high_x = 0, low_y = 1e30, high_y = 0;
    for (const BuildRow& row : report.rows) {
        if (row.mesh != mesh || row.top || row.times.empty() || row.mode == "low memory") continue;
        const double x = double(row.primitives), y = row.rate() * 1e-6;
        lines[row.by + ", " + row.mode].push_back({x, y});
        low_x = std::min(low_x, x);
        high_x = std::max(high_x, x);
        low_y = std::min(low_y, y);
        high_y = std::max(high_y, y);
    }
    if (lines.empty()) return "";
    low_y = std::pow(10.0, std::floor(std::log10(low_y)));
    high_y = std::pow(10.0, std::ceil(std::log10(high_y * 1.01)));
    if (high_x <= low_x) high_x = low_x * 10;
    constexpr double kLeft = 60, kTop = 24, kWidth = 480, kHeight = 320;
    auto at_x = [&](double x) { return kLeft + kWidth * std::log(x / low_x) / std::log(high_x / low_x); };
    auto at_y = [&](double y) { return kTop + kHeight * (1 - std::log(y / low_y) / std::log(high_y / low_y)); };
    auto number = [](double v) { return format("%.1f", v); };
    std::string svg =
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"760\" height=\"400\" font-family=\"sans-serif\" "
        "font-size=\"12\">\n<rect width=\"760\" height=\"400\" fill=\"white\"/>\n<text x=\"60\" y=\"16\">Build, " +
        mesh + ": million triangles a second, " + report.device + "</text>\n";
    for (double y = low_y; y <= high_y * 1.001; y *= 10)
        svg += "<path d=\"M60 " + number(at_y(y)) + "h480\" stroke=\"#ddd\"/><text x=\"54\" y=\"" +
               number(at_y(y) + 4) + "\" text-anchor=\"end\">" + format("%g", y) + "</text>\n";
    for (double x = std::pow(10.0, std::ceil(std::log10(low_x) - 1e-9)); x <= high_x * 1.001; x *= 10)
        svg += "<path d=\"M" + number(at_x(x)) + " 24v320\" stroke=\"#ddd\"/><text x=\"" + number(at_x(x)) +
               "\" y=\"362\" text-anchor=\"middle\">" + format("%g", x) + "</text>\n";
    svg += "<text x=\"300\" y=\"386\" text-anchor=\"middle\">triangles</text>\n";
    const char* colors[] = {"#1b6ca8", "#d1495b", "#2e8b57", "#8a5cb8", "#c9861a", "#555555", "#00a0a0", "#a05050",
                            "#808000"};
    size_t index = 0;
    for (const auto& [name, points] : lines) {
        const std::string color = colors[index % std::size(colors)];
        std::string path;
        for (const auto& [x, y] : points) path += (path.empty() ? "M" : "L") + number(at_x(x)) + " " + number(at_y(y));
        svg += "<path d=\"" + path + "\" fill=\"none\" stroke=\"" + color + "\" stroke-width=\"2\"/>\n";
        for (const auto& [x, y] : points)
            svg += "<circle cx=\"" + number(at_x(x)) + "\" cy=\"" + number(at_y(y)) + "\" r=\"3\" fill=\"" + color +
                   "\"/>";
        const double y = 40 + 20 * double(index++);
        svg += "\n<path d=\"M556 " + number(y - 4) + "h20\" stroke=\"" + color + "\" stroke-width=\"2\"/><text x=\"582\" y=\"" +
               number(y) + "\">" + name + "</text>\n";
    }
    return svg + "</svg>\n";
}

}  // namespace rtc::bench
