// How far two pictures of one scene are apart.
#pragma once

#include <string>
#include <vector>

#include "renderer.h"

namespace rtc::tools {

struct Comparison {
    size_t pixels = 0;
    size_t within = 0;  // every channel within 1e-3 relative (of values above 1e-3)
    double mean_difference[3] = {};
    double standard_error[3] = {};  // of that mean
    double largest = 0;             // relative difference
    size_t first_hits_differ = 0;   // pixels whose instance or primitive differ (last sample)
    bool has_first_hits = false;
    std::vector<double> differences;  // relative, one a pixel

    // The bars of the comparison with native drivers: 99 % of pixels within, means within 3 standard errors.
    bool passed() const;
};

Comparison compare(const RenderResult& a, const RenderResult& b);
std::string as_text(const Comparison& comparison);
std::string as_json(const Comparison& comparison);

}  // namespace rtc::tools
