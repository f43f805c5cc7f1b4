// Values that come from files: JSON whose errors name the line, raw bytes, pictures for the layers of images.
#pragma once

#include "values.h"

namespace rtc::run {

// A JSON file, // comments allowed. Throws tools::Error "FILE:LINE:COLUMN: ..." for what is no JSON.
Json read_json(const std::string& path);

// The library's text without its "[json.exception...]".
std::string problem_of(const Json::exception& error);

// Raw content where a block's members may stand instead: a sequence, {"file": PATH}, or {"pattern": NAME} of `size`
// bytes. False, and `bytes` untouched, for anything else.
bool raw_bytes(const Json& spec, size_t size, const AddressOf& address, Bytes& bytes);

// Texels of an image from {"file": PATH} or {"files": [PATH...]}: each picture is one slice of a 3-D image, or one layer
// or cube face of another; a single picture serves for all. A file named .bin holds encoded texels, and "size" says
// how many. `extent` and `layers` become those of the pictures. False when `spec` names no file.
bool file_texels(const Json& spec, const TexelFormat& format, bool slices, VkExtent3D& extent, uint32_t& layers,
                 Bytes& texels);

}  // namespace rtc::run
