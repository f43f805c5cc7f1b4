// rtc-accuracy report: tables and plots from the JSON of earlier runs, merged by device.
#include <algorithm>
#include <fstream>

#include "command_line.h"
#include "commands.h"
#include "error.h"
#include "report.h"

namespace rtc::lab {

int report_command(int argc, char** argv) {
    CLI::App app{"Tables and plots from what runs with --json wrote; runs of one device become one table."};
    std::vector<std::string> files;
    std::string markdown_path, plot_prefix, link;
    app.add_option("files", files, "JSON files")->required();
    app.add_option("--markdown", markdown_path, "write the tables (default: to the terminal)");
    app.add_option("--plots", plot_prefix, "write PREFIX1.svg, PREFIX2.svg ..., one a device, linked from the tables");
    app.add_option("--link", link, "the prefix as the tables' links have it (default: as --plots)");
    if (const int status = tools::parse_command_line(app, "rtc-accuracy report", argc, argv); status >= 0) return status;
    std::vector<nlohmann::ordered_json> runs;
    for (const std::string& path : files) {
        std::ifstream file(path);
        if (!file) throw tools::Error("cannot read " + path);
        try {
            runs.push_back(nlohmann::ordered_json::parse(file));
            summarise({runs.back()});
        } catch (const std::exception& problem) {
            throw tools::Error(path + ": " + problem.what());
        }
    }
    std::string text;
    int number = 0;
    for (const DeviceReport& report : summarise(runs)) {
        std::string name;
        ++number;
        const bool costs = std::any_of(report.subjects.begin(), report.subjects.end(),
                                       [](const Summary& s) { return s.nanoseconds > 0; });
        if (!plot_prefix.empty() && costs) {  // without costs there is nothing to draw
            name = std::to_string(number) + ".svg";
            write_file(plot_prefix + name, plot_svg(report));
        }
        text += markdown_table(report, name.empty() ? "" : (link.empty() ? plot_prefix : link) + name);
    }
    if (markdown_path.empty()) {
        std::fputs(text.c_str(), stdout);
    } else {
        write_file(markdown_path, text);
    }
    return 0;
}

}  // namespace rtc::lab
