// JobPipeline to one compute module, through rtc's C library.
#pragma once

#include <string>
#include <vector>

#include <rtc/compiler.h>

#include "ray_tracing_job.h"

namespace rtc::tools {

struct CompileOptions {
    bool optimize = true;
    bool debug_info = false;
    // Lanes can suspend; needed on devices that end long loops (RtrPhysicalDeviceSupport).
    bool resumable = true;
    bool checked = false;    // traversal checks the memory it reads
    bool specialize = true;  // remove what cannot be needed
    std::string assume;      // promises about scenes, as rtc --assume takes them
    rtcc_accuracy accuracy = RTCC_ACCURACY_WATERTIGHT;
    bool addresses = false;  // acceleration structures by device address instead of in a heap
    int reserved_set = -1;
    uint32_t reserved_binding = 0;
};

struct CompiledModule {
    std::vector<uint32_t> words;
    std::string warnings;  // "file:line: warning: ..." lines
    std::string reflection_json;
    double seconds = 0;
};

// Throws Error with the compiler's messages.
CompiledModule compile_job(const JobPipeline& pipeline, const CompileOptions& options = {});

// Whether a linked module reaches acceleration structures by device address.
bool is_address_module(const std::vector<uint32_t>& words);

std::string read_text_file(const std::string& path);             // throws Error
std::vector<uint32_t> read_words_file(const std::string& path);  // throws Error unless whole words

}  // namespace rtc::tools
