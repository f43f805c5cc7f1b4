// How rtc is to trace in one column of the trace benchmark, parsed from --variant.
#pragma once

#include <rtc/runtime.h>

#include <string>
#include <vector>

#include "addressing.h"

namespace rtc::bench {

struct TraceVariant {
    std::string name;  // the text it was parsed from, or "rtc"
    RtrTraceOptions options = RTR_TRACE_OPTIONS_DEFAULT;
    bool fast_build = false;
    tools::Addressing addressing = tools::Addressing::Recommended;
    int resumable = -1;  // -1: as the device needs
    bool optimize = true;
    bool ext_dialect = false;
    bool specialize = true;  // false: nothing is removed from the modules
    std::string assume;      // promises about the scene, separated by commas
    std::string modules;  // folder of modules made by --save-modules, instead of compiling
};

// "KEY=VALUE,KEY=VALUE,…"; see variant_help(). Throws tools::Error naming the key or value.
TraceVariant parse_variant(const std::string& text);
const char* variant_help();
std::string fetch_name(RtrFetch fetch);

}  // namespace rtc::bench
