// rtc-bench: measures what docs/benchmarks.md reports.
#include <algorithm>
#include <cstdio>
#include <exception>

#include "command_line.h"
#include "commands.h"

int main(int argc, char** argv) {
    CLI::App app{"Benchmarks of rtc"};
    app.require_subcommand(1);
    rtc::bench::add_compile_command(app);
#ifdef RTC_BENCH_TRACE
    rtc::bench::add_trace_command(app);
    rtc::bench::add_specialise_command(app);
    rtc::bench::add_build_command(app);
#endif
    // Subcommands run while the line is parsed.
    try {
        return std::max(rtc::tools::parse_command_line(app, "rtc-bench", argc, argv), 0);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "rtc-bench: error: %s\n", error.what());
        return 1;
    }
}
