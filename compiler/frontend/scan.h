// A light look at GLSL text before glslang sees it: which dialect it speaks and
// which stage it claims, without a full preprocessing.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace rtc {

// Comments become blanks; line numbers stay.
std::string strip_comments(std::string_view text);

struct StagePragma {
    std::string name;
    uint32_t line = 0;
};

struct SourceFacts {
    bool names_nv = false;   // #extension GL_NV_ray_tracing
    bool names_ext = false;  // #extension GL_EXT_ray_tracing, or any extension built on it
    int version = 0;         // of #version; 0: there is none
    std::string profile;     // "core", "compatibility", "es" or empty
    uint32_t version_line = 0;
    std::vector<StagePragma> stage_pragmas;
};

SourceFacts scan_source(std::string_view text);

}  // namespace rtc
