#include "report.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

#include "../common/image_file.h"

namespace rtc::run {

using tools::Error;

namespace {

struct Scalar {
    Type::Kind kind;
    uint32_t width;
};

Scalar scalar_of(const std::string& type) {
    if (type == "u32") return {Type::Kind::Uint, 32};
    if (type == "i32") return {Type::Kind::Int, 32};
    if (type == "f32") return {Type::Kind::Float, 32};
    if (type == "u64") return {Type::Kind::Uint, 64};
    if (type == "i64") return {Type::Kind::Int, 64};
    if (type == "f64") return {Type::Kind::Float, 64};
    throw Error("expect: unknown type '" + type + "' (u32 i32 f32 u64 i64 f64)");
}

uint64_t bits_at(const Bytes& bytes, size_t index, const Scalar& scalar) {
    uint64_t bits = 0;
    size_t size = scalar.width / 8;
    if ((index + 1) * size > bytes.size()) throw Error("expect: index past the end of the buffer");
    std::memcpy(&bits, &bytes[index * size], size);
    return bits;
}

double as_double(uint64_t bits, const Scalar& scalar) {
    if (scalar.kind != Type::Kind::Float)
        return scalar.kind == Type::Kind::Int ? double(scalar.width == 32 ? int32_t(bits) : int64_t(bits))
                                              : double(bits);
    if (scalar.width == 64) {
        double value;
        std::memcpy(&value, &bits, 8);
        return value;
    }
    float value;
    std::memcpy(&value, &bits, 4);
    return value;
}

std::string show(uint64_t bits, const Scalar& scalar) {
    std::ostringstream out;
    out.precision(9);
    if (scalar.kind == Type::Kind::Float)
        out << as_double(bits, scalar);
    else if (scalar.kind == Type::Kind::Int)
        out << (scalar.width == 32 ? int64_t(int32_t(bits)) : int64_t(bits));
    else if (bits > 0xffff)
        out << "0x" << std::hex << bits;
    else
        out << bits;
    return out.str();
}

const Output* find(const RunResult& result, Slot slot) {
    for (const Output& output : result.outputs)
        if (output.slot == slot && output.element == 0) return &output;
    return nullptr;
}

bool close(double got, double wanted, double absolute, double relative) {
    if (std::isnan(got) || std::isnan(wanted)) return std::isnan(got) && std::isnan(wanted);
    if (got == wanted) return true;
    return std::fabs(got - wanted) <= absolute + relative * std::max(std::fabs(got), std::fabs(wanted));
}

}  // namespace

std::vector<CellResult> check_expectations(const Job& job, const RunResult& result, const RunResult* oracle) {
    std::vector<CellResult> cells;
    for (const Expectation& expect : job.expectations) {
        CellResult cell;
        cell.cell = expect.cell;
        cell.passed = true;
        const Output* output = find(result, expect.slot);
        if (!output) throw Error("expect: no stage writes binding " + slot_name(expect.slot));
        Scalar scalar = scalar_of(expect.type);
        std::vector<uint64_t> wanted;
        if (expect.values.is_null()) {
            const Output* truth = oracle ? find(*oracle, expect.slot) : nullptr;
            if (!truth) throw Error("cell '" + expect.cell + "' needs a native run to compare with");
            for (size_t i = expect.at; (i + 1) * (scalar.width / 8) <= truth->bytes.size(); ++i)
                wanted.push_back(bits_at(truth->bytes, i, scalar));
        } else {
            for (const Json& value : expect.values)
                wanted.push_back(number_bits(value, scalar.kind, scalar.width));
        }
        for (size_t i = 0; i < wanted.size(); ++i) {
            uint64_t got = bits_at(output->bytes, expect.at + i, scalar);
            if (got == wanted[i]) continue;
            if (scalar.kind == Type::Kind::Float &&
                close(as_double(got, scalar), as_double(wanted[i], scalar), expect.absolute, expect.relative))
                continue;
            cell.passed = false;
            cell.known = expect.native;
            cell.detail = "value " + std::to_string(expect.at + i) + ": " + show(got, scalar) +
                          ", expected " + show(wanted[i], scalar);
            break;
        }
        cells.push_back(std::move(cell));
    }
    return cells;
}

std::vector<Difference> compare(const RunResult& a, const RunResult& b, const Tolerance& tolerance) {
    std::vector<Difference> all;
    if (a.outputs.size() != b.outputs.size()) throw Error("the two runs have different outputs");
    for (size_t i = 0; i < a.outputs.size(); ++i) {
        const Output &x = a.outputs[i], &y = b.outputs[i];
        Difference d;
        d.output = output_title(x);
        auto note = [&](const std::string& where, const std::string& got, const std::string& wanted) {
            ++d.differing;
            if (d.examples.size() < 8) d.examples.push_back(where + ": " + got + " and " + wanted);
        };
        if (x.is_image) {
            auto left = decode_texels(x.bytes, x.format), right = decode_texels(y.bytes, y.format);
            uint32_t channels = x.format.channels;
            d.items = left.size() / channels;
            for (size_t texel = 0; texel < d.items; ++texel) {
                bool same = true;
                for (uint32_t c = 0; c < channels; ++c) {
                    double p = left[texel * channels + c], q = right[texel * channels + c];
                    if (p != q && !(std::isnan(p) && std::isnan(q)))
                        d.largest = std::max(d.largest, std::fabs(p - q));
                    same &= close(p, q, tolerance.absolute, tolerance.relative);
                }
                if (same) continue;
                std::ostringstream l, r, at;
                for (uint32_t c = 0; c < channels; ++c) {
                    l << (c ? " " : "") << left[texel * channels + c];
                    r << (c ? " " : "") << right[texel * channels + c];
                }
                at << "(" << texel % x.extent.width << ", " << texel / x.extent.width << ")";
                note(at.str(), l.str(), r.str());
            }
        } else {
            d.items = x.bytes.size() / 4;
            // Words are compared as bits; floats of a float buffer within the tolerance.
            bool floats = false;
            if (x.block) {
                const Type* leaf = x.block.get();
                while (leaf && (leaf->element || leaf->members.size() == 1))
                    leaf = leaf->element ? leaf->element.get() : leaf->members[0].type.get();
                floats = leaf && leaf->kind == Type::Kind::Float && leaf->width == 32;
            }
            Scalar scalar{floats ? Type::Kind::Float : Type::Kind::Uint, 32};
            for (size_t word = 0; word < d.items && (word + 1) * 4 <= y.bytes.size(); ++word) {
                uint64_t p = bits_at(x.bytes, word, scalar), q = bits_at(y.bytes, word, scalar);
                if (p == q) continue;
                if (floats) {
                    d.largest = std::max(d.largest, std::fabs(as_double(p, scalar) - as_double(q, scalar)));
                    if (close(as_double(p, scalar), as_double(q, scalar), tolerance.absolute,
                              tolerance.relative))
                        continue;
                }
                note("word " + std::to_string(word), show(p, scalar), show(q, scalar));
            }
        }
        d.acceptable = double(d.differing) <= tolerance.allowed * double(d.items);
        all.push_back(std::move(d));
    }
    return all;
}

std::string output_title(const Output& output) {
    std::ostringstream out;
    out << (output.is_image ? "image " : "buffer ") << slot_name(output.slot);
    if (output.element) out << "[" << output.element << "]";
    if (!output.name.empty()) out << " (" << output.name << ")";
    if (output.is_image) {
        out << ", " << output.extent.width << "x" << output.extent.height;
        if (output.extent.depth > 1) out << "x" << output.extent.depth;
    } else {
        out << ", " << output.bytes.size() << " bytes";
    }
    return out.str();
}

void write_output(const Output& output, const std::string& path) {
    auto ends = [&](const char* extension) { return path.ends_with(extension); };
    if (ends(".png") || ends(".exr") || ends(".pfm")) {
        if (!output.is_image)
            throw Error(path + ": binding " + slot_name(output.slot) + " is a buffer; write .bin or .json");
        auto values = decode_texels(output.bytes, output.format);
        uint32_t channels = std::max(output.format.channels, 1u), out_channels = channels == 2 ? 3 : channels;
        if (ends(".pfm") && out_channels == 4) out_channels = 3;
        if (ends(".png") && out_channels == 4) out_channels = 3;
        tools::Picture picture(output.extent.width,
                               output.extent.height * output.extent.depth * output.layers, out_channels);
        double scale = output.format.component == Type::Kind::Float ? 1.0 : 1.0 / 255;
        for (size_t texel = 0; texel < values.size() / channels; ++texel)
            for (uint32_t c = 0; c < out_channels; ++c)
                picture.pixels[texel * out_channels + c] =
                    c < channels ? float(values[texel * channels + c] * scale) : 0.0f;
        tools::write_picture(path, picture);
        return;
    }
    std::ofstream out(path, std::ios::binary);
    if (!out) throw Error("cannot write '" + path + "'");
    if (ends(".json")) {
        Json json = output.is_image ? Json(decode_texels(output.bytes, output.format))
                    : output.block  ? read_typed(*output.block, output.bytes.data(), output.bytes.size())
                                    : Json(output.bytes);
        out << json.dump(1) << "\n";
    } else {
        out.write(reinterpret_cast<const char*>(output.bytes.data()), std::streamsize(output.bytes.size()));
    }
    if (!out.flush()) throw Error("writing '" + path + "' failed");
}

}  // namespace rtc::run
