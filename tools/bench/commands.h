// The subcommands of rtc-bench; each adds its options and runs when it was named.
#pragma once

#include <CLI/CLI.hpp>

namespace rtc::bench {

void add_compile_command(CLI::App& app);
void add_trace_command(CLI::App& app);
void add_specialise_command(CLI::App& app);
void add_build_command(CLI::App& app);

}  // namespace rtc::bench
