// A golden set: one folder with SPIR-V assembly, a command saying how to link it, and the text expected of it.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "pipeline.h"

namespace rtc::test {

struct GoldenCase {
    std::string name;
    PipelineInput input;
    LinkOptions options;  // stop_after is the command's `dump`
};

// Thrown for a set that is itself wrong: unreadable file, bad command, assembly that does not assemble.
struct GoldenError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// The `command` file, one item a line, # begins a comment:
//   stage KIND NAME FILE[:ENTRY] [spec.ID=VALUE...]   FILE is GLSL; FILE.spvasm beside it is what is linked
//   group general NAME
//   group triangles|procedural NAME [closest-hit=STAGE] [any-hit=STAGE] [intersection=STAGE]
//   option max-recursion-depth|max-callable-depth|reserved-set|optimize|resumable|debug-info VALUE
//   dump PASS
GoldenCase read_golden_case(const std::filesystem::path& folder);

// All folders below `root` that hold a command, by name.
std::vector<std::filesystem::path> golden_folders(const std::filesystem::path& root);

// Diagnostics as comment lines, then the dump.
std::string golden_text(const LinkResult& result);

std::vector<uint32_t> assemble_file(const std::filesystem::path& spvasm);
std::string read_text(const std::filesystem::path& file);

}  // namespace rtc::test
