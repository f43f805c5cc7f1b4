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

    // The dump is the finished module, not the states before traversal is linked.
    bool whole_module() const { return options.stop_after != "split"; }
};

// Thrown for a set that is itself wrong: unreadable file, bad command, assembly that does not assemble.
struct GoldenError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// The `command` file, one item a line, # begins a comment:
//   stage KIND NAME FILE[:ENTRY] [spec.ID=VALUE...]   FILE is GLSL; FILE.spvasm beside it is what is linked
//   group general NAME
//   group triangles|procedural NAME [closest-hit=STAGE] [any-hit=STAGE] [intersection=STAGE]
//   option max-recursion-depth|max-callable-depth|reserved-set|optimize|resumable|debug-info|specialize VALUE
//   option assume NAME[,NAME...]
//   dump PASS
GoldenCase read_golden_case(const std::filesystem::path& folder);

// All folders below `root` that hold a command, by name.
std::vector<std::filesystem::path> golden_folders(const std::filesystem::path& root);

// Diagnostics as comment lines, then the dump. Of a dump before traversal is linked only the functions and what they
// use are kept, in the order of use, with ids that depend on nothing else: an edit of the traversal kernels, whose
// types and constants the module already shares, leaves the text alone.
std::string golden_text(const LinkResult& result, bool whole_module);

// What golden_text does to a disassembled module (canonical_text.cpp).
std::string canonical_text(const std::string& disassembly);

std::vector<uint32_t> assemble_file(const std::filesystem::path& spvasm);
std::string read_text(const std::filesystem::path& file);

}  // namespace rtc::test
