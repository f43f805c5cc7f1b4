#include "image_file.h"

#include <stb/stb_image.h>
#include <stb/stb_image_write.h>
#include <tinyexr.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "error.h"

namespace rtc::tools {
namespace {

std::string extension_of(const std::string& path) {
    const size_t dot = path.find_last_of('.');
    if (dot == std::string::npos) return "";
    std::string extension = path.substr(dot);
    for (char& c : extension) c = char(std::tolower(static_cast<unsigned char>(c)));
    return extension;
}

// IEC 61966-2-1.
float to_srgb(float linear) {
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

float from_srgb(float encoded) {
    return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

void write_png(const std::string& path, const Picture& picture, bool srgb) {
    std::vector<uint8_t> bytes(picture.pixels.size());
    for (size_t i = 0; i < bytes.size(); ++i) {
        const bool alpha = picture.channels == 4 && i % 4 == 3;
        float value = picture.pixels[i];
        value = std::isnan(value) ? 0.0f : std::clamp(value, 0.0f, 1.0f);
        if (srgb && !alpha) value = to_srgb(value);
        bytes[i] = uint8_t(std::lround(value * 255.0f));
    }
    if (!stbi_write_png(path.c_str(), int(picture.width), int(picture.height), int(picture.channels),
                        bytes.data(), int(picture.width * picture.channels)))
        throw Error("cannot write " + path);
}

// Debevec's portable float map: rows from the bottom up, a negative scale says little-endian.
void write_pfm(const std::string& path, const Picture& picture) {
    const uint32_t channels = picture.channels >= 3 ? 3 : 1;
    std::ofstream file(path, std::ios::binary);
    const bool little = std::endian::native == std::endian::little;
    file << (channels == 3 ? "PF\n" : "Pf\n") << picture.width << ' ' << picture.height << '\n'
         << (little ? "-1.0\n" : "1.0\n");
    for (uint32_t y = picture.height; y-- > 0;)
        for (uint32_t x = 0; x < picture.width; ++x)
            file.write(reinterpret_cast<const char*>(picture.at(x, y)),
                       std::streamsize(channels * sizeof(float)));
    if (!file) throw Error("cannot write " + path);
}

Picture read_pfm(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::string magic;
    uint32_t width = 0, height = 0;
    float scale = 0;
    file >> magic >> width >> height >> scale;
    file.get();
    if (!file || (magic != "PF" && magic != "Pf") || width == 0 || height == 0 || width > 65536 ||
        height > 65536)
        throw Error(path + " is not a PFM picture");
    const bool little = std::endian::native == std::endian::little;
    if ((scale < 0) != little) throw Error(path + ": PFM of the other byte order");
    Picture picture(width, height, magic == "PF" ? 3 : 1);
    for (uint32_t y = height; y-- > 0;)
        file.read(reinterpret_cast<char*>(picture.at(0, y)),
                  std::streamsize(sizeof(float)) * width * picture.channels);
    if (!file) throw Error(path + " ends early");
    return picture;
}

}  // namespace

void require_writable(const std::string& path) {
    std::error_code ignored;
    const bool existed = std::filesystem::exists(path, ignored);
    if (std::filesystem::is_directory(path, ignored)) throw Error("cannot write " + path + ": it is a folder");
    errno = 0;
    const bool opened = std::ofstream(path, std::ios::binary | std::ios::app).is_open();
    if (!opened) throw Error("cannot write " + path + ": " + std::strerror(errno ? errno : EIO));
    if (!existed) std::filesystem::remove(path, ignored);
}

bool can_write_picture(const std::string& path) {
    const std::string extension = extension_of(path);
    return extension == ".png" || extension == ".pfm" || extension == ".exr";
}

void write_picture(const std::string& path, const Picture& picture, bool srgb) {
    const std::string extension = extension_of(path);
    if (extension == ".png") {
        write_png(path, picture, srgb);
    } else if (extension == ".pfm") {
        write_pfm(path, picture);
    } else if (extension == ".exr") {
        const char* problem = nullptr;
        if (SaveEXR(picture.pixels.data(), int(picture.width), int(picture.height), int(picture.channels), 0,
                    path.c_str(), &problem) != TINYEXR_SUCCESS) {
            const std::string text = problem ? problem : "cannot write";
            FreeEXRErrorMessage(problem);
            throw Error(path + ": " + text);
        }
    } else {
        throw Error(path + ": pictures are written as .png, .exr or .pfm");
    }
}

Picture read_picture(const std::string& path, bool srgb) {
    const std::string extension = extension_of(path);
    if (extension == ".pfm") return read_pfm(path);
    if (extension == ".exr") {
        float* data = nullptr;
        int width = 0, height = 0;
        const char* problem = nullptr;
        if (LoadEXR(&data, &width, &height, path.c_str(), &problem) != TINYEXR_SUCCESS) {
            const std::string text = problem ? problem : "cannot read";
            FreeEXRErrorMessage(problem);
            throw Error(path + ": " + text);
        }
        Picture picture(uint32_t(width), uint32_t(height), 4);
        std::copy(data, data + picture.pixels.size(), picture.pixels.begin());
        std::free(data);
        return picture;
    }
    int width = 0, height = 0, channels = 0;
    if (extension == ".hdr") {
        float* data = stbi_loadf(path.c_str(), &width, &height, &channels, 4);
        if (!data) throw Error("cannot read " + path + ": " + stbi_failure_reason());
        Picture picture(uint32_t(width), uint32_t(height), 4);
        std::copy(data, data + picture.pixels.size(), picture.pixels.begin());
        stbi_image_free(data);
        return picture;
    }
    uint8_t* data = stbi_load(path.c_str(), &width, &height, &channels, 4);
    if (!data) throw Error("cannot read " + path + ": " + stbi_failure_reason());
    Picture picture(uint32_t(width), uint32_t(height), 4);
    for (size_t i = 0; i < picture.pixels.size(); ++i) {
        const float value = float(data[i]) / 255.0f;
        picture.pixels[i] = srgb && i % 4 != 3 ? from_srgb(value) : value;
    }
    stbi_image_free(data);
    return picture;
}

}  // namespace rtc::tools
