// rtc-conformance: the conformance suite as one program. The cases are JSON files that the build generates from
// tests/conformance/cases; running them is rtc-run's suite (suite.cpp).
#include <cstdio>
#include <filesystem>

#include "backend.h"
#include "command_line.h"

namespace rtc::run {
namespace {

using tools::Error;

// Beside the build that made the program, or where it was installed or packed.
std::string find_cases_folder(const char* program, const std::string& given) {
    if (!given.empty()) return given;
    const std::filesystem::path here = std::filesystem::weakly_canonical(program).parent_path();
    for (const std::filesystem::path& folder : {here / "../cases", here / "../share/rtc/conformance",
                                                std::filesystem::path(RTC_CONFORMANCE_CASES)})
        if (std::filesystem::is_directory(folder)) return folder.string();
    throw Error("cannot find the cases; the build writes them to " RTC_CONFORMANCE_CASES ", --cases names another folder");
}

int list(const std::string& folder, const std::string& pattern) {
    size_t cells = 0;
    const std::vector<std::string> files = suite_files(folder, pattern);
    for (const std::string& file : files) {
        const Job job = load_case(file);
        std::printf("%s  (%s)\n", job.name.c_str(), job.section.c_str());
        for (const Expectation& expectation : job.expectations) std::printf("    %s\n", expectation.cell.c_str());
        cells += job.expectations.size();
    }
    std::printf("%zu cases, %zu cells\n", files.size(), cells);
    return files.empty() ? 1 : 0;
}

}  // namespace
}  // namespace rtc::run

int main(int argc, char** argv) {
    rtc::run::SuiteOptions suite;
    std::string folder, pattern;
    bool list = false;
    CLI::App app{
        "rtc-conformance: the rules of ray tracing pipelines, one case a rule, with expectations computed from the\n"
        "specification. A case is a pipeline, each of its cells a rule, or a built-in in a stage in a situation.\n"
        "docs/conformance.md has the results; tests/conformance/run runs all columns of a machine."};
    app.add_flag("--list", list, "list cases, their sections and cells");
    app.add_option("--run", pattern, "cases whose name holds this text, or fits this pattern of * and ?");
    app.add_option("--device", suite.host.device, "index, or part of the name");
    app.add_option("--json", suite.json, "write the results there");
    app.add_option("--on", suite.variants,
                   "rtc-nv, rtc-ext: rtc in NV spelling and as EXT twins (default: both); khr, nv: the device's own ray tracing")
        ->delimiter(',');
    app.add_option("--cases", folder, "folder of case files");
    app.add_option("--timeout", suite.timeout_seconds, "seconds for one case (120)");
    app.add_flag("--validate", suite.host.validate, "run under the Khronos validation layer");
    app.add_flag("-v,--verbose", suite.verbose, "print cases that pass, and warnings");
    if (const int status = rtc::tools::parse_command_line(app, "rtc-conformance", argc, argv); status >= 0) return status;
    return rtc::tools::run_program("rtc-conformance", [&] {
        folder = rtc::run::find_cases_folder(argv[0], folder);
        if (list) return rtc::run::list(folder, pattern);
        for (const std::string& variant : suite.variants) rtc::run::variant_of(variant);
        suite.folder = folder;
        suite.filter = pattern;
        return rtc::run::run_suite(suite);
    });
}
