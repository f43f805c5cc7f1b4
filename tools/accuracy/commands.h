// rtc-accuracy's commands, and what their reports share.
#pragma once

#include <cstdint>
#include <string>

#include "command_line.h"

namespace rtc::lab {

// argv[0] is the command's own name. Exit status; throws tools::Error.
int leaks_command(int argc, char** argv);
int spawn_command(int argc, char** argv);
int agree_command(int argc, char** argv);
int report_command(int argc, char** argv);
int check_command(int argc, char** argv);
// Without a command: everything about some subjects on one device.
int measure_command(int argc, char** argv);

// 95 % bound on a rate of which `events` were seen in `n`: the rule of three when none was, else about two
// standard deviations up.
double upper_bound(uint64_t events, uint64_t n);
// For CLI options: 1 to 10^15 rays, negative numbers being refused rather than taken for huge ones; 0 as well.
inline CLI::Validator some_rays() { return tools::number_between(1, 1e15); }
inline CLI::Validator rays_or_none() { return tools::number_between(0, 1e15); }
void write_file(const std::string& path, const std::string& text);  // throws tools::Error

}  // namespace rtc::lab
