#include "values.h"

#include <spirv/unified1/spirv.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "../common/error.h"

namespace rtc::run {
namespace {

using tools::Error;

struct Scalar {
    Type::Kind kind;
    uint32_t width;
};

bool scalar_of(const std::string& name, Scalar& out) {
    static const std::pair<const char*, Scalar> all[] = {
        {"u8", {Type::Kind::Uint, 8}},    {"i8", {Type::Kind::Int, 8}},     {"u16", {Type::Kind::Uint, 16}},
        {"i16", {Type::Kind::Int, 16}},   {"u32", {Type::Kind::Uint, 32}},  {"i32", {Type::Kind::Int, 32}},
        {"u64", {Type::Kind::Uint, 64}},  {"i64", {Type::Kind::Int, 64}},   {"f16", {Type::Kind::Float, 16}},
        {"f32", {Type::Kind::Float, 32}}, {"f64", {Type::Kind::Float, 64}},
    };
    for (const auto& [text, scalar] : all)
        if (name == text) {
            out = scalar;
            return true;
        }
    return false;
}

void put(Bytes& bytes, size_t at, uint64_t bits, uint32_t count) {
    if (bytes.size() < at + count) bytes.resize(at + count);
    std::memcpy(&bytes[at], &bits, count);  // little-endian hosts
}

double parse_number(const std::string& text) {
    if (text == "nan") return std::nan("");
    if (text == "inf") return INFINITY;
    if (text == "-inf") return -INFINITY;
    try {
        return std::stod(text);
    } catch (const std::exception&) {
        throw Error("'" + text + "' is not a number");
    }
}

}  // namespace

double half_to_double(uint16_t half) {
    int exponent = half >> 10 & 31, mantissa = half & 1023;
    double value = exponent == 0    ? std::ldexp(mantissa, -24)
                   : exponent == 31 ? (mantissa ? std::nan("") : INFINITY)
                                    : std::ldexp(1024 + mantissa, exponent - 25);
    return half & 0x8000 ? -value : value;
}

uint16_t double_to_half(double value) {
    uint16_t sign = std::signbit(value) ? 0x8000 : 0;
    double magnitude = std::fabs(value);
    if (std::isnan(value)) return sign | 0x7e00;
    if (magnitude >= 65520) return sign | 0x7c00;
    if (magnitude < std::ldexp(1, -14)) return sign | uint16_t(std::nearbyint(std::ldexp(magnitude, 24)));
    int exponent;
    double fraction = std::frexp(magnitude, &exponent);  // [0.5, 1)
    int mantissa = int(std::nearbyint(std::ldexp(fraction, 11)));
    if (mantissa == 2048) {
        mantissa = 1024;
        ++exponent;
    }
    return sign | uint16_t((exponent + 14) << 10 | (mantissa & 1023));
}

uint64_t number_bits(const Json& value, Type::Kind kind, uint32_t width) {
    if (kind == Type::Kind::Bool)
        return value.is_boolean() ? value.get<bool>() : (value.is_number() && value.get<double>() != 0);
    if (value.is_boolean()) return value.get<bool>();
    if (kind == Type::Kind::Float) {
        if (value.is_string() && value.get<std::string>().rfind("0x", 0) == 0)
            return std::stoull(value.get<std::string>(), nullptr, 16);
        double number = value.is_string() ? parse_number(value.get<std::string>()) : value.get<double>();
        if (width == 16) return double_to_half(number);
        uint64_t bits = 0;
        if (width == 32) {
            float single = float(number);
            std::memcpy(&bits, &single, 4);
        } else {
            std::memcpy(&bits, &number, 8);
        }
        return bits;
    }
    if (value.is_string()) {
        const std::string text = value.get<std::string>();
        try {
            return text[0] == '-' ? uint64_t(std::stoll(text, nullptr, 0)) : std::stoull(text, nullptr, 0);
        } catch (const std::exception&) {
            throw Error("'" + text + "' is not an integer");
        }
    }
    if (value.is_number_unsigned()) return value.get<uint64_t>();
    if (value.is_number_integer()) return uint64_t(value.get<int64_t>());
    if (value.is_number_float()) return uint64_t(int64_t(value.get<double>()));
    throw Error("a number was expected, not " + value.dump());
}

bool is_sequence(const Json& value) {
    if (value.is_array()) return !value.empty() && std::all_of(value.begin(), value.end(), is_sequence);
    if (!value.is_object() || value.size() != 1) return false;
    Scalar scalar;
    const std::string& key = value.begin().key();
    return scalar_of(key, scalar) || key == "align" || key == "skip" || key == "address";
}

Bytes sequence(const Json& value, const AddressOf& address) {
    Bytes bytes;
    std::function<void(const Json&)> add = [&](const Json& item) {
        if (item.is_array()) {
            for (const Json& inner : item) add(inner);
            return;
        }
        if (!item.is_object())
            throw Error("a typed value like {\"u32\": 1} was expected, not " + item.dump());
        for (const auto& [key, content] : item.items()) {
            Scalar scalar;
            if (key == "align") {
                size_t to = content.get<size_t>();
                bytes.resize((bytes.size() + to - 1) / to * to);
            } else if (key == "skip") {
                bytes.resize(bytes.size() + content.get<size_t>());
            } else if (key == "address") {
                put(bytes, bytes.size(), address(content.get<std::string>()), 8);
            } else if (scalar_of(key, scalar)) {
                auto one = [&](const Json& number) {
                    put(bytes, bytes.size(), number_bits(number, scalar.kind, scalar.width),
                        scalar.width / 8);
                };
                if (content.is_array())
                    for (const Json& number : content) one(number);
                else
                    one(content);
            } else {
                throw Error("unknown value type '" + key +
                            "' (u8 i8 u16 i16 u32 i32 u64 i64 f16 f32 f64, address, "
                            "align, skip)");
            }
        }
    };
    add(value);
    return bytes;
}

void write_typed(const Type& type, const Json& value, Bytes& bytes, size_t offset, const AddressOf& address) {
    switch (type.kind) {
        case Type::Kind::Bool:
        case Type::Kind::Int:
        case Type::Kind::Uint:
        case Type::Kind::Float:
            put(bytes, offset, number_bits(value, type.kind, type.width), type.size());
            return;
        case Type::Kind::Address:
            put(bytes, offset,
                value.is_string() && value.get<std::string>().find('.') != std::string::npos
                    ? address(value.get<std::string>())
                    : number_bits(value, Type::Kind::Uint, 64),
                8);
            return;
        case Type::Kind::Vector:
        case Type::Kind::Array: {
            if (!value.is_array()) {  // one value for every component
                for (uint32_t i = 0; i < type.count; ++i)
                    write_typed(*type.element, value, bytes, offset + size_t(i) * type.stride, address);
                return;
            }
            if (type.count && value.size() > type.count)
                throw Error(std::to_string(value.size()) + " values for " + std::to_string(type.count) +
                            " elements");
            for (size_t i = 0; i < value.size(); ++i)
                write_typed(*type.element, value[i], bytes, offset + i * type.stride, address);
            return;
        }
        case Type::Kind::Matrix: {
            if (!value.is_array() || value.size() != type.count)
                throw Error("a matrix is a list of its " + std::to_string(type.count) + " columns");
            const Type& column = *type.element;
            for (uint32_t c = 0; c < type.count; ++c)
                for (uint32_t r = 0; r < column.count; ++r)
                    write_typed(*column.element, value[c].at(r), bytes,
                                offset + (type.row_major ? r * type.stride + c * column.stride
                                                         : c * type.stride + r * column.stride),
                                address);
            return;
        }
        case Type::Kind::Struct:
            if (value.is_array()) {
                if (value.size() > type.members.size())
                    throw Error("more values than members: " + value.dump());
                for (size_t i = 0; i < value.size(); ++i)
                    write_typed(*type.members[i].type, value[i], bytes, offset + type.members[i].offset,
                                address);
                return;
            }
            if (!value.is_object()) throw Error("an object of members was expected, not " + value.dump());
            for (const auto& [name, inner] : value.items()) {
                auto found = std::find_if(type.members.begin(), type.members.end(),
                                          [&](const Type::Member& member) { return member.name == name; });
                if (found == type.members.end()) {
                    std::string all;
                    for (const auto& member : type.members) all += " " + member.name;
                    throw Error("the block has no member '" + name + "'; it has:" + all);
                }
                write_typed(*found->type, inner, bytes, offset + found->offset, address);
            }
            return;
        case Type::Kind::Opaque:
            throw Error("a value cannot be given for an opaque type");
    }
}

Json read_typed(const Type& type, const uint8_t* bytes, size_t size) {
    if (type.kind != Type::Kind::Array && type.size() > size) return nullptr;
    switch (type.kind) {
        case Type::Kind::Bool:
            return bytes[0] != 0;
        case Type::Kind::Int: {
            int64_t value = 0;
            std::memcpy(&value, bytes, type.width / 8);
            int shift = 64 - int(type.width);
            return int64_t(uint64_t(value) << shift) >> shift;
        }
        case Type::Kind::Uint:
        case Type::Kind::Address: {
            uint64_t value = 0;
            std::memcpy(&value, bytes, type.kind == Type::Kind::Address ? 8 : type.width / 8);
            return value;
        }
        case Type::Kind::Float: {
            if (type.width == 16) {
                uint16_t half;
                std::memcpy(&half, bytes, 2);
                return half_to_double(half);
            }
            if (type.width == 32) {
                float single;
                std::memcpy(&single, bytes, 4);
                return single;
            }
            double value;
            std::memcpy(&value, bytes, 8);
            return value;
        }
        case Type::Kind::Vector:
        case Type::Kind::Array: {
            Json out = Json::array();
            size_t count = type.count ? type.count : type.stride ? size / type.stride : 0;
            for (size_t i = 0; i < count && i * type.stride + type.element->size() <= size; ++i)
                out.push_back(read_typed(*type.element, bytes + i * type.stride, size - i * type.stride));
            return out;
        }
        case Type::Kind::Matrix: {
            Json out = Json::array();
            const Type& column = *type.element;
            for (uint32_t c = 0; c < type.count; ++c) {
                Json values = Json::array();
                for (uint32_t r = 0; r < column.count; ++r)
                    values.push_back(
                        read_typed(*column.element,
                                   bytes + (type.row_major ? r * type.stride + c * column.stride
                                                           : c * type.stride + r * column.stride),
                                   8));
                out.push_back(std::move(values));
            }
            return out;
        }
        case Type::Kind::Struct: {
            Json out = Json::object();
            for (size_t i = 0; i < type.members.size(); ++i) {
                const auto& member = type.members[i];
                std::string name = member.name.empty() ? "member" + std::to_string(i) : member.name;
                out[name] = member.offset <= size
                                ? read_typed(*member.type, bytes + member.offset, size - member.offset)
                                : Json();
            }
            return out;
        }
        case Type::Kind::Opaque:
            break;
    }
    return nullptr;
}

namespace {
// A 32-bit mixer with full avalanche, so that patterns are the same everywhere.
uint32_t hash(uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ x >> 16;
}
}  // namespace

Bytes buffer_pattern(const std::string& name, size_t size) {
    Bytes bytes(size);
    for (size_t i = 0; i * 4 < size; ++i) {
        uint32_t word = 0;
        if (name == "ones") {
            word = 1;
        } else if (name == "iota") {
            word = uint32_t(i);
        } else if (name == "random") {
            word = hash(uint32_t(i) + 1);
        } else if (name == "random-float") {
            float value = float(hash(uint32_t(i) + 1) >> 8) * 0x1p-24f;
            std::memcpy(&word, &value, 4);
        } else if (name != "zero") {
            throw Error("unknown buffer pattern '" + name + "' (zero, ones, iota, random, random-float)");
        }
        std::memcpy(&bytes[i * 4], &word, std::min<size_t>(4, size - i * 4));
    }
    return bytes;
}

TexelFormat texel_format(const std::string& name) {
    using K = Type::Kind;
    static const std::pair<const char*, TexelFormat> all[] = {
        {"rgba32f", {VK_FORMAT_R32G32B32A32_SFLOAT, K::Float, 4, 4, false}},
        {"rg32f", {VK_FORMAT_R32G32_SFLOAT, K::Float, 2, 4, false}},
        {"r32f", {VK_FORMAT_R32_SFLOAT, K::Float, 1, 4, false}},
        {"rgba16f", {VK_FORMAT_R16G16B16A16_SFLOAT, K::Float, 4, 2, false}},
        {"rg16f", {VK_FORMAT_R16G16_SFLOAT, K::Float, 2, 2, false}},
        {"r16f", {VK_FORMAT_R16_SFLOAT, K::Float, 1, 2, false}},
        {"rgba8", {VK_FORMAT_R8G8B8A8_UNORM, K::Float, 4, 1, true}},
        {"rg8", {VK_FORMAT_R8G8_UNORM, K::Float, 2, 1, true}},
        {"r8", {VK_FORMAT_R8_UNORM, K::Float, 1, 1, true}},
        {"rgba16", {VK_FORMAT_R16G16B16A16_UNORM, K::Float, 4, 2, true}},
        {"rgba32ui", {VK_FORMAT_R32G32B32A32_UINT, K::Uint, 4, 4, false}},
        {"rg32ui", {VK_FORMAT_R32G32_UINT, K::Uint, 2, 4, false}},
        {"r32ui", {VK_FORMAT_R32_UINT, K::Uint, 1, 4, false}},
        {"rgba16ui", {VK_FORMAT_R16G16B16A16_UINT, K::Uint, 4, 2, false}},
        {"rgba8ui", {VK_FORMAT_R8G8B8A8_UINT, K::Uint, 4, 1, false}},
        {"r8ui", {VK_FORMAT_R8_UINT, K::Uint, 1, 1, false}},
        {"rgba32i", {VK_FORMAT_R32G32B32A32_SINT, K::Int, 4, 4, false}},
        {"r32i", {VK_FORMAT_R32_SINT, K::Int, 1, 4, false}},
    };
    for (const auto& [text, format] : all)
        if (name == text) return format;
    std::string list;
    for (const auto& entry : all) list += std::string(" ") + entry.first;
    throw Error("unknown image format '" + name + "'; there are:" + list);
}

TexelFormat texel_format_of(uint32_t format, Type::Kind component) {
    switch (format) {
        case spv::ImageFormatRgba32f:
            return texel_format("rgba32f");
        case spv::ImageFormatRg32f:
            return texel_format("rg32f");
        case spv::ImageFormatR32f:
            return texel_format("r32f");
        case spv::ImageFormatRgba16f:
            return texel_format("rgba16f");
        case spv::ImageFormatRg16f:
            return texel_format("rg16f");
        case spv::ImageFormatR16f:
            return texel_format("r16f");
        case spv::ImageFormatRgba8:
            return texel_format("rgba8");
        case spv::ImageFormatRg8:
            return texel_format("rg8");
        case spv::ImageFormatR8:
            return texel_format("r8");
        case spv::ImageFormatRgba16:
            return texel_format("rgba16");
        case spv::ImageFormatRgba32ui:
            return texel_format("rgba32ui");
        case spv::ImageFormatRg32ui:
            return texel_format("rg32ui");
        case spv::ImageFormatR32ui:
            return texel_format("r32ui");
        case spv::ImageFormatRgba16ui:
            return texel_format("rgba16ui");
        case spv::ImageFormatRgba8ui:
            return texel_format("rgba8ui");
        case spv::ImageFormatR8ui:
            return texel_format("r8ui");
        case spv::ImageFormatRgba32i:
            return texel_format("rgba32i");
        case spv::ImageFormatR32i:
            return texel_format("r32i");
        case spv::ImageFormatUnknown:
            return component == Type::Kind::Uint  ? texel_format("rgba32ui")
                   : component == Type::Kind::Int ? texel_format("rgba32i")
                                                  : texel_format("rgba32f");
        default:
            throw Error("image format " + std::to_string(format) +
                        " of a shader is not supported by rtc-run");
    }
}

Bytes encode_texels(const std::vector<double>& values, const TexelFormat& format) {
    Bytes bytes;
    bytes.reserve(values.size() * format.channel_bytes);
    for (double value : values) {
        uint64_t bits;
        if (format.normalized) {
            double top = format.channel_bytes == 1 ? 255 : 65535;
            bits = uint64_t(std::lround(std::clamp(value, 0.0, 1.0) * top));
        } else {
            bits = number_bits(Json(value), format.component, format.channel_bytes * 8);
        }
        put(bytes, bytes.size(), bits, format.channel_bytes);
    }
    return bytes;
}

std::vector<double> decode_texels(const Bytes& bytes, const TexelFormat& format) {
    Type scalar;
    scalar.kind = format.normalized ? Type::Kind::Uint : format.component;
    scalar.width = format.channel_bytes * 8;
    std::vector<double> out;
    for (size_t at = 0; at + format.channel_bytes <= bytes.size(); at += format.channel_bytes) {
        double value = read_typed(scalar, &bytes[at], format.channel_bytes).get<double>();
        out.push_back(format.normalized ? value / (format.channel_bytes == 1 ? 255.0 : 65535.0) : value);
    }
    return out;
}

Bytes image_pattern(const std::string& name, const TexelFormat& format, VkExtent3D extent, uint32_t layers) {
    std::vector<double> values;
    double scale = format.component == Type::Kind::Float ? 1 : 255;
    uint32_t index = 0;
    for (uint32_t layer = 0; layer < layers; ++layer)
        for (uint32_t z = 0; z < extent.depth; ++z)
            for (uint32_t y = 0; y < extent.height; ++y)
                for (uint32_t x = 0; x < extent.width; ++x, ++index) {
                    double u = (x + 0.5) / extent.width, v = (y + 0.5) / extent.height,
                           w = (z + 0.5) / extent.depth;
                    double texel[4] = {0, 0, 0, 1};
                    if (name == "checker") {
                        bool on = ((x * 8 / extent.width) + (y * 8 / extent.height) + z + layer) & 1;
                        texel[0] = texel[1] = texel[2] = on ? 0.9 : 0.1;
                    } else if (name == "gradient") {
                        texel[0] = u;
                        texel[1] = v;
                        texel[2] = extent.depth > 1 ? w : (layer + 0.5) / layers;
                    } else if (name == "uv") {
                        texel[0] = u;
                        texel[1] = v;
                    } else if (name == "noise") {
                        for (int c = 0; c < 3; ++c) texel[c] = hash(index * 4 + uint32_t(c)) / 4294967296.0;
                    } else if (name == "white") {
                        texel[0] = texel[1] = texel[2] = 1;
                    } else if (name == "grey") {
                        texel[0] = texel[1] = texel[2] = 0.5;
                    } else if (name == "index") {
                        texel[0] = texel[1] = texel[2] = index / scale;
                    } else if (name != "black") {
                        throw Error("unknown image pattern '" + name +
                                    "' (checker, gradient, uv, noise, white, grey, black, index)");
                    }
                    for (uint32_t c = 0; c < format.channels; ++c) values.push_back(texel[c] * scale);
                }
    return encode_texels(values, format);
}

}  // namespace rtc::run
