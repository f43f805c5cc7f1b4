// The same launches natively and through rtc with every ray recorded, and what the records say.
#pragma once

#include <string>

#include "renderer.h"

namespace rtc::tools {

struct Recorded {
    std::string text;
    std::string json;  // members of an object: "recorded_pictures", "classification", "differing_pixels"
    bool passed = false;  // rtc has no wrong answer, and the pictures pass
};

Recorded compare_recorded(const RtcDevice& device, const Scene& scene, const RenderOptions& options);

}  // namespace rtc::tools
