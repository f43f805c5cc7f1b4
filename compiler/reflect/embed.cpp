// Reflection inside a module: OpString "rtc.reflection:<index>/<count>:<base64>"
// (abi.h). OpString holds at most 65535 - 3 words and must be UTF-8, hence base64
// in chunks; nothing refers to the strings, so every consumer skips them.
#include <spirv/unified1/spirv.hpp11>

#include <charconv>
#include <cstring>
#include <string_view>

#include "reflect/reflection_io.h"
#include "rtc/abi.h"

namespace rtc {
namespace {

constexpr std::string_view kPrefix = "rtc.reflection:";
// A multiple of 3, so that chunks decode alone; 56 000 characters of base64.
constexpr size_t kChunkBytes = 42000;
constexpr size_t kHeaderWords = 5;
constexpr char kAlphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::string encode(const uint8_t* bytes, size_t size) {
    std::string text((size + 2) / 3 * 4, '=');
    char* to = text.data();
    for (size_t i = 0; i < size; i += 3, to += 4) {
        const size_t left = size - i;
        const uint32_t group = static_cast<uint32_t>(bytes[i]) << 16 |
                               (left > 1 ? static_cast<uint32_t>(bytes[i + 1]) << 8 : 0) |
                               (left > 2 ? static_cast<uint32_t>(bytes[i + 2]) : 0);
        to[0] = kAlphabet[group >> 18 & 63];
        to[1] = kAlphabet[group >> 12 & 63];
        if (left > 1) to[2] = kAlphabet[group >> 6 & 63];
        if (left > 2) to[3] = kAlphabet[group & 63];
    }
    return text;
}

int digit(char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
}

bool decode(std::string_view text, std::vector<uint8_t>& bytes) {
    if (text.size() % 4 != 0) return false;
    for (size_t i = 0; i < text.size(); i += 4) {
        const bool last = i + 4 == text.size();
        const int padding = !last ? 0 : (text[i + 3] == '=') + (text[i + 3] == '=' && text[i + 2] == '=');
        uint32_t group = 0;
        for (int k = 0; k < 4; ++k) {
            const int value = k >= 4 - padding ? 0 : digit(text[i + k]);
            if (value < 0) return false;
            group = group << 6 | static_cast<uint32_t>(value);
        }
        for (int k = 0; k < 3 - padding; ++k)
            bytes.push_back(static_cast<uint8_t>(group >> (16 - 8 * k) & 0xff));
    }
    return true;
}

// One OpString of the module that holds a chunk of ours.
struct Chunk {
    size_t word = 0, words = 0;  // place in the module
    uint32_t index = 0, count = 0;
    std::string base64;
};

bool parse_chunk(const std::string& text, Chunk& chunk) {
    if (text.compare(0, kPrefix.size(), kPrefix) != 0) return false;
    const char* at = text.data() + kPrefix.size();
    const char* const end = text.data() + text.size();
    auto parsed = std::from_chars(at, end, chunk.index);
    if (parsed.ec != std::errc() || parsed.ptr == end || *parsed.ptr != '/') return false;
    parsed = std::from_chars(parsed.ptr + 1, end, chunk.count);
    if (parsed.ec != std::errc() || parsed.ptr == end || *parsed.ptr != ':') return false;
    chunk.base64.assign(parsed.ptr + 1, end);
    return true;
}

std::string string_operand(const uint32_t* words, size_t count) {
    std::string text(count * 4, '\0');
    for (size_t i = 0; i < count; ++i)
        for (int k = 0; k < 4; ++k) text[i * 4 + k] = static_cast<char>(words[i] >> (8 * k) & 0xff);
    text.resize(std::strlen(text.c_str()));
    return text;
}

// Everything up to and with the OpString/OpSource section (logical layout, SPIR-V §2.4, item 7a).
bool is_before_names(spv::Op op) {
    switch (op) {
        case spv::Op::OpCapability:
        case spv::Op::OpExtension:
        case spv::Op::OpExtInstImport:
        case spv::Op::OpMemoryModel:
        case spv::Op::OpEntryPoint:
        case spv::Op::OpExecutionMode:
        case spv::Op::OpExecutionModeId:
        case spv::Op::OpString:
        case spv::Op::OpSourceExtension:
        case spv::Op::OpSource:
        case spv::Op::OpSourceContinued:
            return true;
        default:
            return false;
    }
}

// Finds our chunks and where names begin. False when the module's framing is damaged.
bool find_chunks(const std::vector<uint32_t>& spirv, std::vector<Chunk>& chunks, size_t& names_at) {
    if (spirv.size() < kHeaderWords || spirv[0] != spv::MagicNumber) return false;
    size_t at = kHeaderWords;
    while (at < spirv.size()) {
        const size_t count = spirv[at] >> 16;
        const auto op = static_cast<spv::Op>(spirv[at] & 0xffff);
        if (count == 0 || count > spirv.size() - at) return false;
        if (!is_before_names(op)) break;
        if (op == spv::Op::OpString && count >= 3) {
            Chunk chunk;
            if (parse_chunk(string_operand(&spirv[at + 2], count - 2), chunk)) {
                chunk.word = at;
                chunk.words = count;
                chunks.push_back(std::move(chunk));
            }
        }
        at += count;
    }
    names_at = at;
    return true;
}

RtcModuleHeader header_of(const Reflection& r, size_t json_bytes) {
    RtcModuleHeader header = {};
    header.magic = RTC_MODULE_MAGIC;
    header.abi_version = RTC_ABI_VERSION;
    header.flags = r.flags;
    header.identity = r.identity;
    header.reserved_set = r.reserved_set;
    header.reserved_binding = r.reserved_binding;
    header.used_bindings = r.used_bindings;
    header.group_count = static_cast<uint32_t>(r.groups.size());
    header.state_count = r.state_count;
    header.max_recursion_depth = r.max_recursion_depth;
    header.max_callable_depth = r.max_callable_depth;
    header.stack_words = r.stack_words;
    header.scratch_words = r.scratch_words;
    header.payload_words = r.payload_words;
    header.attribute_words = r.attribute_words;
    header.callable_words = r.callable_words;
    header.assumptions = r.assumptions;
    header.json_bytes = static_cast<uint32_t>(json_bytes);
    return header;
}

// The decoded chunks, joined; false with `error`.
bool join_chunks(const std::vector<uint32_t>& spirv, std::vector<uint8_t>& bytes, std::string& error) {
    std::vector<Chunk> chunks;
    size_t names_at = 0;
    if (!find_chunks(spirv, chunks, names_at)) {
        error = "not a whole SPIR-V module";
        return false;
    }
    if (chunks.empty()) {
        error =
            "the module carries no rtc reflection (made by another compiler, or its strings were stripped)";
        return false;
    }
    const size_t count = chunks[0].count;
    std::vector<const Chunk*> ordered(count == chunks.size() ? count : 0, nullptr);
    for (const Chunk& chunk : chunks)
        if (chunk.count == count && chunk.index < ordered.size()) ordered[chunk.index] = &chunk;
    bool whole = !ordered.empty();
    for (const Chunk* chunk : ordered) whole = whole && chunk && decode(chunk->base64, bytes);
    if (!whole) error = "damaged reflection: its chunks do not fit together";
    return whole;
}

bool split_blob(const std::vector<uint8_t>& bytes, RtcModuleHeader& header, std::string& json,
                std::string& error) {
    if (bytes.size() >= sizeof header) std::memcpy(&header, bytes.data(), sizeof header);
    if (bytes.size() < sizeof header || header.magic != RTC_MODULE_MAGIC) {
        error = "damaged reflection: no header";
        return false;
    }
    if (header.abi_version != RTC_ABI_VERSION) {
        error = "the module is of ABI version " + std::to_string(header.abi_version) + ", this rtc has " +
                std::to_string(RTC_ABI_VERSION);
        return false;
    }
    const uint64_t groups = static_cast<uint64_t>(header.group_count) * sizeof(RtcModuleGroup);
    if (sizeof header + groups + header.json_bytes != bytes.size()) {
        error = "damaged reflection: its sizes do not add up";
        return false;
    }
    json.assign(reinterpret_cast<const char*>(bytes.data()) + sizeof header + groups, header.json_bytes);
    return true;
}

}  // namespace

void embed_reflection(std::vector<uint32_t>& spirv, const Reflection& reflection) {
    std::vector<Chunk> old_chunks;
    size_t names_at = 0;
    if (!find_chunks(spirv, old_chunks, names_at)) return;

    const std::string json = embedded_json(reflection);
    const RtcModuleHeader header = header_of(reflection, json.size());
    std::vector<uint8_t> blob(sizeof header);
    std::memcpy(blob.data(), &header, sizeof header);
    for (const GroupReport& group : reflection.groups) {
        RtcModuleGroup packed = {};
        packed.kind = static_cast<uint32_t>(group.kind);
        std::memcpy(packed.handle, group.handle, sizeof packed.handle);
        const auto* raw = reinterpret_cast<const uint8_t*>(&packed);
        blob.insert(blob.end(), raw, raw + sizeof packed);
    }
    blob.insert(blob.end(), json.begin(), json.end());

    std::vector<uint32_t> strings;
    const size_t count = (blob.size() + kChunkBytes - 1) / kChunkBytes;
    uint32_t bound = spirv[3];
    for (size_t index = 0; index < count; ++index) {
        const size_t begin = index * kChunkBytes;
        const size_t size = std::min(kChunkBytes, blob.size() - begin);
        const std::string text = std::string(kPrefix) + std::to_string(index) + "/" + std::to_string(count) +
                                 ":" + encode(blob.data() + begin, size);
        std::vector<uint32_t> literal(text.size() / 4 + 1, 0);
        for (size_t i = 0; i < text.size(); ++i)
            literal[i / 4] |= static_cast<uint32_t>(static_cast<uint8_t>(text[i])) << (8 * (i % 4));
        strings.push_back(static_cast<uint32_t>(literal.size() + 2) << 16 |
                          static_cast<uint32_t>(spv::Op::OpString));
        strings.push_back(bound++);
        strings.insert(strings.end(), literal.begin(), literal.end());
    }
    spirv.insert(spirv.begin() + static_cast<std::ptrdiff_t>(names_at), strings.begin(), strings.end());
    for (size_t i = old_chunks.size(); i-- > 0;) {
        const auto at = spirv.begin() + static_cast<std::ptrdiff_t>(old_chunks[i].word);
        spirv.erase(at, at + static_cast<std::ptrdiff_t>(old_chunks[i].words));
    }
    spirv[3] = bound;
}

bool extract_reflection_json(const std::vector<uint32_t>& spirv, std::string& json) {
    std::vector<uint8_t> bytes;
    std::string error;
    RtcModuleHeader header;
    return join_chunks(spirv, bytes, error) && split_blob(bytes, header, json, error);
}

bool read_reflection(const std::vector<uint32_t>& spirv, Reflection& reflection, std::string& error) {
    std::vector<uint8_t> bytes;
    RtcModuleHeader header;
    std::string json;
    if (!join_chunks(spirv, bytes, error) || !split_blob(bytes, header, json, error)) return false;
    if (!reflection_from_json(json, reflection, error)) return false;
    if (reflection.groups.size() != header.group_count || reflection.identity != header.identity) {
        error = "damaged reflection: header and JSON disagree";
        return false;
    }
    return true;
}

}  // namespace rtc
