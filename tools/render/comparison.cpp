#include "comparison.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "error.h"

namespace rtc::tools {

Comparison compare(const RenderResult& a, const RenderResult& b) {
    const Picture &p = a.picture, &q = b.picture;
    if (p.width != q.width || p.height != q.height || p.channels != 4 || q.channels != 4)
        throw Error("pictures of different size cannot be compared");
    Comparison result;
    result.pixels = size_t(p.width) * p.height;
    double sums[3] = {}, squares[3] = {};
    for (size_t i = 0; i < result.pixels; ++i) {
        double worst = 0;
        for (size_t c = 0; c < 3; ++c) {
            const double x = double(p.pixels[4 * i + c]), y = double(q.pixels[4 * i + c]);
            const double difference = y - x;
            worst = std::max(worst, std::abs(difference) / std::max({std::abs(x), std::abs(y), 1e-3}));
            sums[c] += difference;
            squares[c] += difference * difference;
            if (std::isnan(difference)) worst = 1e30;
        }
        result.within += worst <= 1e-3;
        result.largest = std::max(result.largest, worst);
        result.differences.push_back(worst);
    }
    const double count = double(result.pixels);
    for (int c = 0; c < 3; ++c) {
        // Paths that part after a tie are independent samples of the same light: the differences have mean
        // zero, and this is the standard error of their mean.
        result.mean_difference[c] = sums[c] / count;
        result.standard_error[c] =
            std::sqrt(std::max(0.0, squares[c] / count - std::pow(sums[c] / count, 2)) / count);
    }
    if (a.gbuffer.size() == result.pixels * 16 && b.gbuffer.size() == a.gbuffer.size()) {
        result.has_first_hits = true;
        for (size_t i = 0; i < result.pixels; ++i) {
            uint32_t x[2], y[2];
            std::memcpy(x, &a.gbuffer[16 * i], sizeof x);
            std::memcpy(y, &b.gbuffer[16 * i], sizeof y);
            // A miss has no primitive.
            result.first_hits_differ += x[0] != y[0] || (x[0] != ~0u && x[1] != y[1]);
        }
    }
    return result;
}

bool Comparison::passed() const {
    if (double(within) < 0.99 * double(pixels)) return false;
    for (int c = 0; c < 3; ++c)
        if (!(std::abs(mean_difference[c]) <= 3 * standard_error[c] + 1e-7)) return false;
    return true;
}

std::string as_text(const Comparison& comparison) {
    char text[512];
    std::snprintf(text, sizeof text,
                  "compare: %.3f %% of pixels within 1e-3 relative, largest difference %.2e\n"
                  "compare: mean differences %.2e %.2e %.2e (standard errors %.2e %.2e %.2e)\n",
                  100.0 * double(comparison.within) / double(comparison.pixels), comparison.largest,
                  comparison.mean_difference[0], comparison.mean_difference[1], comparison.mean_difference[2],
                  comparison.standard_error[0], comparison.standard_error[1], comparison.standard_error[2]);
    std::string result = text;
    if (comparison.has_first_hits)
        result += "compare: first hits differ at " + std::to_string(comparison.first_hits_differ) + " of " +
                  std::to_string(comparison.pixels) + " pixels\n";
    result += comparison.passed() ? "compare: passed\n" : "compare: FAILED\n";
    return result;
}

std::string as_json(const Comparison& comparison) {
    char text[512];
    std::snprintf(text, sizeof text,
                  "{\"pixels\": %zu, \"within\": %zu, \"largest\": %.3g, \"mean_difference\": [%.3g, %.3g, %.3g], "
                  "\"standard_error\": [%.3g, %.3g, %.3g], \"passed\": %s}",
                  comparison.pixels, comparison.within, comparison.largest, comparison.mean_difference[0],
                  comparison.mean_difference[1], comparison.mean_difference[2], comparison.standard_error[0],
                  comparison.standard_error[1], comparison.standard_error[2],
                  comparison.passed() ? "true" : "false");
    return text;
}

}  // namespace rtc::tools
