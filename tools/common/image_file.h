// Pictures on the host and on disk: PNG (sRGB, 8 bits), PFM and EXR (linear floats).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace rtc::tools {

// Rows from top to bottom, channels interleaved, linear light.
struct Picture {
    uint32_t width = 0, height = 0, channels = 4;
    std::vector<float> pixels;

    Picture() = default;
    Picture(uint32_t width_, uint32_t height_, uint32_t channels_)
        : width(width_), height(height_), channels(channels_), pixels(size_t(width_) * height_ * channels_) {}
    float* at(uint32_t x, uint32_t y) { return &pixels[(size_t(y) * width + x) * channels]; }
    const float* at(uint32_t x, uint32_t y) const { return &pixels[(size_t(y) * width + x) * channels]; }
};

// Whether write_picture knows the extension; asked before hours of work.
bool can_write_picture(const std::string& path);
// Throws Error unless a file can be made or replaced there; leaves what is there as it is. Asked before the
// work, so that a wrong folder costs nothing.
void require_writable(const std::string& path);
// The extension chooses: .png (clamped, sRGB curve; `srgb` false writes values * 255 as they are),
// .pfm (1 or 3 channels; a fourth is dropped), .exr (32-bit floats). Throws Error.
void write_picture(const std::string& path, const Picture& picture, bool srgb = true);
// .png and .jpg become linear light unless `srgb` is false; .pfm, .exr and .hdr are read as they are.
Picture read_picture(const std::string& path, bool srgb = true);

}  // namespace rtc::tools
