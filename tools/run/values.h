// JSON into bytes: buffers, blocks, records, images, by layout or as raw sequences.
#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "module_reader.h"

namespace rtc::run {

using Json = nlohmann::json;
using Bytes = std::vector<uint8_t>;

// Device address of a bound buffer by "SET.BINDING", for records and blocks that hold pointers.
using AddressOf = std::function<uint64_t(const std::string&)>;

// A sequence of typed values: {"u32": [1, 2]}, {"f32": 0.5}, {"address": "0.3"}, {"align": 16}, {"skip": 4},
// or a list of those. Types: u8 i8 u16 i16 u32 i32 u64 i64 f32 f64 f16.
Bytes sequence(const Json& value, const AddressOf& address);
bool is_sequence(const Json& value);

// Writes `value` over `bytes` at `offset` by layout: members by name or in order, arrays, vectors,
// matrices by columns, scalars as numbers, booleans, or "0x.." / "nan" / "inf" strings.
void write_typed(const Type& type, const Json& value, Bytes& bytes, size_t offset, const AddressOf& address);

// The other direction, for .json outputs.
Json read_typed(const Type& type, const uint8_t* bytes, size_t size);

// "zero", "ones", "iota", "random", "random-float": `size` bytes.
Bytes buffer_pattern(const std::string& name, size_t size);

uint64_t number_bits(const Json& value, Type::Kind kind, uint32_t width);
double half_to_double(uint16_t half);
uint16_t double_to_half(double value);

// Texels of an image, all layers: RGBA as float or integers.
struct TexelFormat {
    VkFormat format;
    Type::Kind component;
    uint32_t channels, channel_bytes;
    bool normalized;
};
TexelFormat texel_format(const std::string& name);  // "rgba8", "r32ui", ...
TexelFormat texel_format_of(uint32_t spirv_image_format, Type::Kind component);
// "checker", "gradient", "uv", "noise", "white", "black", "grey", "index"
Bytes image_pattern(const std::string& name, const TexelFormat& format, VkExtent3D extent, uint32_t layers);
Bytes encode_texels(const std::vector<double>& values, const TexelFormat& format);
std::vector<double> decode_texels(const Bytes& bytes, const TexelFormat& format);

}  // namespace rtc::run
