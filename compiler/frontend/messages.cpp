#include "frontend/messages.h"

#include <algorithm>
#include <cctype>
#include <charconv>

namespace rtc {
namespace {

bool starts_with(std::string_view text, std::string_view prefix) {
    return text.substr(0, prefix.size()) == prefix;
}

bool contains(std::string_view text, std::string_view part) {
    return text.find(part) != std::string_view::npos;
}

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.remove_suffix(1);
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front()))) text.remove_prefix(1);
    return text;
}

// "name:12: text": the first ":digits: " ends the name, so names may hold colons.
bool split_position(std::string_view text, std::string& file, uint32_t& line, std::string_view& rest) {
    for (size_t colon = text.find(':'); colon != std::string_view::npos; colon = text.find(':', colon + 1)) {
        size_t end = colon + 1;
        while (end < text.size() && std::isdigit(static_cast<unsigned char>(text[end]))) ++end;
        if (end == colon + 1 || end >= text.size() || text[end] != ':') continue;
        uint32_t value = 0;
        const auto parsed = std::from_chars(text.data() + colon + 1, text.data() + end, value);
        if (parsed.ec != std::errc()) continue;
        file = std::string(text.substr(0, colon));
        line = value;
        rest = trimmed(text.substr(end + 1));
        return true;
    }
    return false;
}

bool is_summary(std::string_view text) {
    return contains(text, "compilation errors.  No code generated") ||
           contains(text, ": compilation terminated") || contains(text, "SPIR-V is not generated");
}

// After an unknown name glslang goes on with a float in its place; what it then
// says about swizzles, assignments and duplicates on that line helps nobody.
bool is_consequence(const Diagnostic& message, const std::vector<Diagnostic>& earlier) {
    for (const Diagnostic& other : earlier) {
        if (other.file != message.file || message.line == 0) continue;
        const bool unknown = contains(other.text, "undeclared identifier") ||
                             contains(other.text, "maybe an instance name is needed");
        // The float stays for the rest of the file.
        if (unknown && contains(message.text, "swizzle")) return true;
        if (other.line != message.line) continue;
        if (other.text == message.text) return true;
        if (unknown && (contains(message.text, "cannot convert") ||
                        (starts_with(message.text, other.text.substr(0, other.text.find(" :"))) &&
                         contains(message.text, "undeclared identifier"))))
            return true;
    }
    return false;
}

}  // namespace

bool has_errors(const std::vector<Diagnostic>& diagnostics) {
    return std::any_of(diagnostics.begin(), diagnostics.end(),
                       [](const Diagnostic& d) { return d.severity == Severity::Error; });
}

void parse_glslang_log(std::string_view log, const std::string& file, std::vector<Diagnostic>& out) {
    const size_t first = out.size();
    for (size_t begin = 0; begin < log.size();) {
        size_t end = log.find('\n', begin);
        if (end == std::string_view::npos) end = log.size();
        std::string_view line = trimmed(log.substr(begin, end - begin));
        begin = end + 1;
        if (line.empty() || is_summary(line) || line == file) continue;

        Diagnostic message;
        message.severity = Severity::Error;
        bool known = true;
        if (starts_with(line, "ERROR: ") || starts_with(line, "error: ")) {
            line.remove_prefix(7);
        } else if (starts_with(line, "WARNING: ") || starts_with(line, "warning: ")) {
            line.remove_prefix(9);
            message.severity = Severity::Warning;
        } else if (starts_with(line, "INTERNAL ERROR: ")) {
            line.remove_prefix(16);
        } else if (starts_with(line, "UNIMPLEMENTED: ")) {
            line.remove_prefix(15);
        } else {
            known = false;
        }
        if (!known) {
            // A continuation of the message before it (link errors print several lines).
            if (out.size() > first) out.back().text += "\n    " + std::string(line);
            continue;
        }
        message.id = message.severity == Severity::Error ? "glsl-error" : "glsl-warning";
        std::string_view rest;
        if (split_position(line, message.file, message.line, rest)) {
            message.text = std::string(rest);
        } else {
            message.file = file;
            message.text = std::string(line);
        }
        if (message.file.empty()) message.file = file;
        const size_t doubled = message.text.find(" :  ");
        if (doubled != std::string::npos) message.text.erase(doubled + 2, 1);
        if (!is_consequence(message, out)) out.push_back(std::move(message));
    }
    // "Missing entry point" after a syntax error is only its echo.
    if (out.size() - first > 1) {
        const bool other_error = std::any_of(out.begin() + first, out.end(), [](const Diagnostic& d) {
            return d.severity == Severity::Error && d.text.find("Missing entry point") == std::string::npos;
        });
        if (other_error)
            std::erase_if(out, [](const Diagnostic& d) {
                return d.text.find("Missing entry point") != std::string::npos;
            });
    }
}

}  // namespace rtc
