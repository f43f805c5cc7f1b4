#include "output.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>

#include "error.h"

namespace cli {

void write_output(const std::string& path, const std::string& bytes) {
    if (path == "-") {
        std::cout.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush();
        if (!std::cout) throw InputError("rtc: error: cannot write to the standard output");
        return;
    }
    errno = 0;
    std::ofstream stream(path, std::ios::binary | std::ios::trunc);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush();
    if (!stream)
        throw InputError("rtc: error: cannot write output file: '" + path + "'" +
                         (errno ? std::string(": ") + std::strerror(errno) : ""));
}

std::string format_words(const uint32_t* words, size_t count, BinaryFormat format) {
    std::string out;
    if (format == BinaryFormat::Bin) {
        out.resize(count * 4);
        std::memcpy(out.data(), words, count * 4);
        return out;
    }
    if (format == BinaryFormat::C) out = "{";
    for (size_t i = 0; i < count; ++i) {
        char text[16];
        std::snprintf(text, sizeof text, "0x%08x", words[i]);
        if (i) out += i % 8 == 0 ? ",\n" : ",";
        out += text;
    }
    return out + (format == BinaryFormat::C ? "}\n" : "\n");
}

std::string make_rule(const std::string& target, const std::vector<std::string>& dependencies) {
    std::string rule = target + ":";
    for (const std::string& file : dependencies) {
        rule += ' ';
        for (char c : file) {
            if (c == ' ' || c == '#') rule += '\\';
            if (c == '$') rule += '$';
            rule += c;
        }
    }
    return rule + "\n";
}

}  // namespace cli
