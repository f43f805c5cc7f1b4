// rtc-accuracy report: tables and plots from the JSON of earlier runs, merged by device.
#include <algorithm>
#include <fstream>

#include "command_line.h"
#include "commands.h"
#include "error.h"
#include "report.h"

namespace rtc::lab {
namespace {

std::vector<nlohmann::ordered_json> read_runs(const std::vector<std::string>& files) {
    std::vector<nlohmann::ordered_json> runs;
    for (const std::string& path : files) {
        std::ifstream file(path);
        if (!file) throw tools::Error("cannot read " + path);
        try {
            runs.push_back(nlohmann::ordered_json::parse(file));
            summarise({runs.back()});
        } catch (const nlohmann::json::exception&) {
            throw tools::Error(path + ": not what rtc-accuracy --json writes, or cut off");
        } catch (const std::exception& problem) {
            throw tools::Error(path + ": " + problem.what());
        }
    }
    return runs;
}

}  // namespace

int report_command(int argc, char** argv) {
    CLI::App app{"Tables and plots from what runs with --json wrote; runs of one device become one table."};
    std::vector<std::string> files;
    std::string markdown_path, knobs_path, plot_prefix, link;
    app.add_option("files", files, "JSON files")->required();
    app.add_option("--markdown", markdown_path, "write the tables (default: to the terminal)");
    app.add_option("--knobs", knobs_path, "write the tables of points beside the tiers (default: to the terminal)");
    app.add_option("--plots", plot_prefix, "write PREFIX1.svg, PREFIX2.svg ..., one a device, linked from the tables");
    app.add_option("--link", link, "the prefix as the tables' links have it (default: as --plots)");
    if (const int status = tools::parse_command_line(app, "rtc-accuracy report", argc, argv); status >= 0) return status;
    const std::vector<nlohmann::ordered_json> runs = read_runs(files);
    std::string text, knobs;
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
        text += text.ends_with("\n\n") ? "" : "\n";
        knobs += knob_table(report);
    }
    if (markdown_path.empty()) {
        std::fputs(text.c_str(), stdout);
    } else {
        write_file(markdown_path, text);
    }
    if (knobs_path.empty()) {
        std::fputs(knobs.c_str(), stdout);
    } else {
        write_file(knobs_path, knobs);
    }
    return 0;
}

int check_command(int argc, char** argv) {
    CLI::App app{"Whether fresh runs with --json agree with earlier ones of the same devices: promises hold, rates differ by no\n"
                 "more than chance explains, ratios of times by no more than a tolerance. Exit code 1 if not."};
    std::vector<std::string> files, against;
    Tolerances tolerances;
    app.add_option("files", files, "JSON files of fresh runs")->required();
    app.add_option("--against", against, "JSON files of earlier ones")->required();
    app.add_option("--cost-tolerance", tolerances.cost, "of ratios of times")->check(tools::number_between(0, 10));
    if (const int status = tools::parse_command_line(app, "rtc-accuracy check", argc, argv); status >= 0) return status;
    const Verdict verdict = compare_runs(read_runs(files), read_runs(against), tolerances);
    for (const std::string& note : verdict.notes) std::printf("note: %s\n", note.c_str());
    for (const std::string& text : verdict.disagreements) std::printf("DISAGREES: %s\n", text.c_str());
    std::printf("%llu figures compared, %zu disagree\n", (unsigned long long)verdict.compared, verdict.disagreements.size());
    return verdict.disagreements.empty() ? 0 : 1;
}

}  // namespace rtc::lab
