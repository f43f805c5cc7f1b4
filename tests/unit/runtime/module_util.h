// Turns a compiled compute shader into what the runtime takes for a linked module.
#pragma once

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "rtc/abi.h"

inline std::string base64(const std::string& in) {
    const char* table = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (size_t i = 0; i < in.size(); i += 3) {
        auto at = [&](size_t k) { return k < in.size() ? static_cast<unsigned char>(in[k]) : 0u; };
        unsigned group = at(i) << 16 | at(i + 1) << 8 | at(i + 2);
        for (int k = 0; k < 4; k++) out += i + k > in.size() ? '=' : table[group >> (18 - 6 * k) & 63];
    }
    return out;
}

inline RtcModuleHeader module_header(uint32_t used_bindings, uint32_t groups) {
    RtcModuleHeader h{};
    h.magic = RTC_MODULE_MAGIC;
    h.abi_version = RTC_ABI_VERSION;
    h.identity = 0x1d1d1d1d;
    h.reserved_set = 1;
    h.used_bindings = used_bindings;
    h.group_count = groups;
    h.max_recursion_depth = 1;
    return h;
}

// Inserts the reflection in `chunks` OpStrings before the first OpSource.
inline std::vector<uint32_t> with_reflection(const uint32_t* words, size_t bytes, RtcModuleHeader header,
                                             const std::string& json, uint32_t chunks = 2) {
    header.json_bytes = static_cast<uint32_t>(json.size());
    std::string blob(reinterpret_cast<const char*>(&header), sizeof header);
    for (uint32_t g = 0; g < header.group_count; g++) {
        RtcModuleGroup group{};
        group.kind = g == 0 ? RTC_GROUP_GENERAL : RTC_GROUP_TRIANGLES;
        group.handle[0] = 100 + g;
        group.handle[3] = group.kind + 1;
        group.handle[7] = header.identity;
        blob.append(reinterpret_cast<const char*>(&group), sizeof group);
    }
    blob += json;
    std::vector<uint32_t> out(words, words + bytes / 4), strings;
    for (uint32_t c = 0; c < chunks; c++) {
        size_t step = (blob.size() / chunks + 2) / 3 * 3, begin = std::min(blob.size(), c * step);
        std::string part = blob.substr(begin, c + 1 == chunks ? std::string::npos : step);
        std::string text =
            "rtc.reflection:" + std::to_string(c) + "/" + std::to_string(chunks) + ":" + base64(part);
        std::vector<uint32_t> literal(text.size() / 4 + 1);
        memcpy(literal.data(), text.data(), text.size());
        strings.push_back(static_cast<uint32_t>(literal.size() + 2) << 16 | 7);
        strings.push_back(out[3]++);
        strings.insert(strings.end(), literal.begin(), literal.end());
    }
    // The runtime's specialisation constants, see reserved_set.glsl.
    for (size_t i = 5; i < out.size() && (out[i] >> 16); i += out[i] >> 16) {
        if ((out[i] & 0xffff) == 71 && out[i + 2] == 1 && out[i + 3] >= 1900)
            out[i + 3] += RTC_SPEC_BASE - 1900;
    }
    size_t at = 5;
    while (at < out.size() && (out[at] & 0xffff) != 3) at += out[at] >> 16;
    out.insert(out.begin() + static_cast<long>(at), strings.begin(), strings.end());
    return out;
}
