// Writing what the compiler made.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "arguments.h"

namespace cli {

// "-" is stdout. Throws InputError when the file cannot be written.
void write_output(const std::string& path, const std::string& bytes);

std::string format_words(const uint32_t* words, size_t count, BinaryFormat format);

// A make rule: "target: a b c\n", blanks and dollars in names escaped.
std::string make_rule(const std::string& target, const std::vector<std::string>& dependencies);

}  // namespace cli
