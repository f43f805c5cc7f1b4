// What came out: written to files, compared with another run, held against expectations.
#pragma once

#include <string>
#include <vector>

#include "session.h"

namespace rtc::run {

struct CellResult {
    std::string cell;
    bool passed = false;
    std::string detail;      // why not
    std::string known = {};  // on a native driver: the recorded reason why it differs
};

// One result a cell of the case. Expectations without values take them from `oracle`.
std::vector<CellResult> check_expectations(const Job& job, const RunResult& result, const RunResult* oracle);

struct Tolerance {
    double relative = 1e-3, absolute = 1e-6;
    double allowed = 0;  // fraction of texels or words that may differ
};

struct Difference {
    std::string output;
    size_t items = 0, differing = 0;  // texels of an image, words of a buffer
    double largest = 0;
    std::vector<std::string> examples;
    bool acceptable = true;
};
std::vector<Difference> compare(const RunResult& a, const RunResult& b, const Tolerance& tolerance);

// .png .exr .pfm for images; .bin raw; .json typed (buffers) or as a list (images).
void write_output(const Output& output, const std::string& path);
std::string output_title(const Output& output);  // "image 0.1 (framebuffer), 512x512"

}  // namespace rtc::run
