#include <spirv/unified1/spirv.hpp11>

#include <bit>
#include <charconv>
#include <cstring>
#include <map>

#include "frontend/frontend.h"

namespace rtc {
namespace {

std::optional<StageKind> kind_of_model(uint32_t model) {
    switch (static_cast<spv::ExecutionModel>(model)) {
        case spv::ExecutionModel::RayGenerationKHR:
            return StageKind::RayGen;
        case spv::ExecutionModel::IntersectionKHR:
            return StageKind::Intersection;
        case spv::ExecutionModel::AnyHitKHR:
            return StageKind::AnyHit;
        case spv::ExecutionModel::ClosestHitKHR:
            return StageKind::ClosestHit;
        case spv::ExecutionModel::MissKHR:
            return StageKind::Miss;
        case spv::ExecutionModel::CallableKHR:
            return StageKind::Callable;
        default:
            return std::nullopt;
    }
}

uint32_t swapped(uint32_t word) {
    return word >> 24 | (word >> 8 & 0xff00u) | (word << 8 & 0xff0000u) | word << 24;
}

// A literal string's words; false when it is not ended inside the instruction.
bool literal_string(const uint32_t* words, size_t count, std::string& text) {
    text.clear();
    for (size_t i = 0; i < count; ++i)
        for (int shift = 0; shift < 32; shift += 8) {
            const char c = static_cast<char>(words[i] >> shift & 0xff);
            if (c == '\0') return true;
            text += c;
        }
    return false;
}

}  // namespace

bool looks_like_spirv(const void* bytes, size_t size) {
    if (size < 4) return false;
    uint32_t magic;
    std::memcpy(&magic, bytes, 4);
    return magic == spv::MagicNumber || magic == swapped(spv::MagicNumber);
}

bool spirv_from_bytes(const void* bytes, size_t size, std::vector<uint32_t>& words, std::string& error) {
    if (!looks_like_spirv(bytes, size)) {
        error = "not a SPIR-V module: wrong magic number";
        return false;
    }
    if (size % 4 != 0 || size < 20) {
        error = "truncated SPIR-V module: " + std::to_string(size) + " bytes are no whole number of words" +
                (size < 20 ? " with a header" : "");
        return false;
    }
    words.resize(size / 4);
    std::memcpy(words.data(), bytes, size);
    if (words[0] != spv::MagicNumber)
        for (uint32_t& word : words) word = swapped(word);
    return true;
}

SpirvInfo inspect_spirv(const std::vector<uint32_t>& words) {
    SpirvInfo info;
    if (words.empty() || words[0] != spv::MagicNumber) {
        info.error = "not a SPIR-V module: wrong magic number";
        return info;
    }
    if (words.size() < 5) {
        info.error = "truncated SPIR-V module: no whole header";
        return info;
    }
    info.version = words[1];
    std::map<uint32_t, uint32_t> spec_ids;  // result id -> SpecId
    std::map<uint32_t, SpecConstantInfo> types;
    for (size_t at = 5; at < words.size();) {
        const uint32_t count = words[at] >> 16;
        const auto op = static_cast<spv::Op>(words[at] & 0xffff);
        if (count == 0 || count > words.size() - at) {
            info.error = "truncated or damaged SPIR-V module: the instruction at word " + std::to_string(at) +
                         " claims " + std::to_string(count) + " words, " + std::to_string(words.size() - at) +
                         " are left";
            return info;
        }
        const uint32_t* w = &words[at];
        if (op == spv::Op::OpEntryPoint && count >= 4) {
            EntryPointInfo entry;
            entry.model = w[1];
            entry.kind = kind_of_model(w[1]);
            if (!literal_string(w + 3, count - 3, entry.name)) {
                info.error = "damaged SPIR-V module: an entry point's name is not ended";
                return info;
            }
            info.entry_points.push_back(std::move(entry));
        } else if (op == spv::Op::OpDecorate && count >= 4 &&
                   w[2] == static_cast<uint32_t>(spv::Decoration::SpecId)) {
            spec_ids[w[1]] = w[3];
        } else if (op == spv::Op::OpTypeBool && count >= 2) {
            types[w[1]] = {0, SpecConstantInfo::Type::Bool, 32};
        } else if (op == spv::Op::OpTypeInt && count >= 4) {
            types[w[1]] = {0, w[3] ? SpecConstantInfo::Type::Int : SpecConstantInfo::Type::Uint, w[2]};
        } else if (op == spv::Op::OpTypeFloat && count >= 3) {
            types[w[1]] = {0, SpecConstantInfo::Type::Float, w[2]};
        } else if ((op == spv::Op::OpSpecConstant || op == spv::Op::OpSpecConstantTrue ||
                    op == spv::Op::OpSpecConstantFalse) &&
                   count >= 3) {
            const auto spec = spec_ids.find(w[2]);
            if (spec != spec_ids.end()) {
                SpecConstantInfo constant = types.count(w[1]) ? types[w[1]] : SpecConstantInfo{};
                constant.spec_id = spec->second;
                info.spec_constants.push_back(constant);
            }
        }
        at += count;
    }
    return info;
}

bool spec_value_from_text(const SpecConstantInfo& constant, std::string_view text, uint64_t& bits,
                          std::string& error) {
    using Type = SpecConstantInfo::Type;
    const std::string value(text);
    const auto fail = [&](const char* expected) {
        error = "'" + value + "' is no " + expected + " (specialisation constant " +
                std::to_string(constant.spec_id) + ")";
        return false;
    };
    if (value.empty()) return fail("value");
    if (constant.type == Type::Bool) {
        if (value == "true" || value == "1")
            bits = 1;
        else if (value == "false" || value == "0")
            bits = 0;
        else
            return fail("bool: true, false, 1 or 0");
        return true;
    }
    if (constant.type == Type::Float) {
        // from_chars, not strtod: an application's locale must not change a constant.
        std::string_view number = value;
        if (number[0] == '+') number.remove_prefix(1);
        if (number.size() > 1 && (number.back() == 'f' || number.back() == 'F') && number != "inf" &&
            number != "-inf")
            number.remove_suffix(1);
        double wide = 0;
        float narrow = 0;
        const char* const end = number.data() + number.size();
        const auto parsed = constant.width == 64 ? std::from_chars(number.data(), end, wide)
                                                 : std::from_chars(number.data(), end, narrow);
        if (number.empty() || parsed.ec != std::errc() || parsed.ptr != end)
            return fail("floating-point number");
        if (constant.width == 64)
            bits = std::bit_cast<uint64_t>(wide);
        else if (constant.width == 32)
            bits = std::bit_cast<uint32_t>(narrow);
        else {
            error = "16-bit float specialisation constants take their bit pattern through the C library only";
            return false;
        }
        return true;
    }
    const bool negative = value[0] == '-';
    std::string_view digits = std::string_view(value).substr(negative ? 1 : 0);
    int base = 10;
    if (digits.size() > 2 && digits[0] == '0' && (digits[1] == 'x' || digits[1] == 'X')) {
        base = 16;
        digits.remove_prefix(2);
    }
    if (!digits.empty() && (digits.back() == 'u' || digits.back() == 'U')) digits.remove_suffix(1);
    uint64_t magnitude = 0;
    const auto parsed = std::from_chars(digits.data(), digits.data() + digits.size(), magnitude, base);
    if (digits.empty() || parsed.ec != std::errc() || parsed.ptr != digits.data() + digits.size())
        return fail("integer");
    const uint32_t width = constant.width;
    const uint64_t mask = width >= 64 ? ~0ull : (1ull << width) - 1;
    const uint64_t largest_negative = width >= 64 ? 1ull << 63 : 1ull << (width - 1);
    if (negative ? (magnitude > largest_negative || (constant.type == Type::Uint && magnitude != 0))
                 : (magnitude & ~mask) != 0) {
        error = "'" + value + "' does not fit specialisation constant " + std::to_string(constant.spec_id) +
                " of " + std::to_string(width) + " bits";
        return false;
    }
    bits = (negative ? 0 - magnitude : magnitude) & mask;
    return true;
}

}  // namespace rtc
