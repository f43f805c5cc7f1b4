#include "files.h"

#include <algorithm>
#include <filesystem>

#include "../common/error.h"
#include "../common/image_file.h"
#include "../native/glsl.h"

namespace rtc::run {

using tools::Error;

namespace {

Bytes read_bytes(const Json& path) {
    const std::string text = native::read_text(path.get<std::string>());
    return Bytes(text.begin(), text.end());
}

}  // namespace

std::string problem_of(const Json::exception& error) {
    const std::string text = error.what();
    const size_t found = text.find("] ");
    return text.rfind("[json.exception.", 0) == 0 && found != std::string::npos ? text.substr(found + 2) : text;
}

Json read_json(const std::string& path) {
    const std::string text = native::read_text(path);
    try {
        return Json::parse(text, nullptr, true, true);
    } catch (const Json::parse_error& error) {
        // Its byte is the one after the mistake.
        const size_t at = std::min(text.size(), error.byte ? error.byte - 1 : 0);
        const size_t line = size_t(std::count(text.begin(), text.begin() + long(at), '\n'));
        const size_t start = at ? text.rfind('\n', at - 1) : std::string::npos;
        const size_t column = at - (start == std::string::npos ? 0 : start + 1);
        std::string what = problem_of(error);  // "parse error at line L, column C: ..."
        if (const size_t found = what.find(": "); found != std::string::npos) what.erase(0, found + 2);
        throw Error(path + ":" + std::to_string(line + 1) + ":" + std::to_string(column + 1) + ": " + what);
    }
}

bool raw_bytes(const Json& spec, size_t size, const AddressOf& address, Bytes& bytes) {
    if (is_sequence(spec)) {
        bytes = sequence(spec, address);
        return true;
    }
    if (!spec.is_object() || spec.size() != 1 || !spec.begin()->is_string()) return false;
    if (spec.contains("file"))
        bytes = read_bytes(spec["file"]);
    else if (spec.contains("pattern"))
        bytes = buffer_pattern(spec["pattern"].get<std::string>(), size);
    else
        return false;
    return true;
}

bool file_texels(const Json& spec, const TexelFormat& format, bool slices, VkExtent3D& extent, uint32_t& layers,
                 Bytes& texels) {
    if (!spec.is_object() || (!spec.contains("file") && !spec.contains("files"))) return false;
    const Json files = spec.contains("files") ? spec["files"] : Json::array({spec["file"]});
    if (!files.is_array() || files.empty()) throw Error("\"files\" is a list of pictures");
    for (const Json& file : files) {
        const std::string path = file.get<std::string>();
        if (std::filesystem::path(path).extension() == ".bin") {
            if (!spec.contains("size")) throw Error(path + ": \"size\" says how many texels these bytes are");
            const Bytes bytes = read_bytes(path);
            texels.insert(texels.end(), bytes.begin(), bytes.end());
            continue;
        }
        const tools::Picture picture = tools::read_picture(path, spec.value("srgb", false));
        if (!texels.empty() && (picture.width != extent.width || picture.height != extent.height))
            throw Error(path + ": " + std::to_string(picture.width) + "x" + std::to_string(picture.height) +
                        ", but the pictures before it have " + std::to_string(extent.width) + "x" +
                        std::to_string(extent.height));
        std::vector<double> values;
        for (size_t i = 0; i < size_t(picture.width) * picture.height; ++i)
            for (uint32_t c = 0; c < format.channels; ++c)
                values.push_back(c < picture.channels ? picture.pixels[i * picture.channels + c] : 1.0);
        const Bytes encoded = encode_texels(values, format);
        texels.insert(texels.end(), encoded.begin(), encoded.end());
        extent = {picture.width, picture.height, 1};
    }
    if (slices && !spec.contains("size")) extent.depth = uint32_t(files.size());
    if (!slices && files.size() > 1) layers = uint32_t(files.size());
    return true;
}

}  // namespace rtc::run
