// rtc-bench: measures what docs/benchmarks.md reports.
#include <cstdio>
#include <exception>

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
    try {
        CLI11_PARSE(app, argc, argv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "rtc-bench: error: %s\n", error.what());
        return 1;
    }
    return 0;
}
