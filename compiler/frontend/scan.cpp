#include "frontend/scan.h"

#include <cctype>
#include <charconv>

namespace rtc {

std::string strip_comments(std::string_view text) {
    std::string out;
    out.reserve(text.size());
    enum { Code, Line, Block, String } state = Code;
    for (size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        const char next = i + 1 < text.size() ? text[i + 1] : '\0';
        switch (state) {
            case Code:
                if (c == '/' && next == '/') {
                    state = Line;
                    ++i;
                } else if (c == '/' && next == '*') {
                    state = Block;
                    out += ' ';
                    ++i;
                } else {
                    if (c == '"') state = String;
                    out += c;
                }
                break;
            case Line:
                if (c == '\\' && next == '\n') {
                    out += '\n';
                    ++i;
                } else if (c == '\n') {
                    state = Code;
                    out += c;
                }
                break;
            case Block:
                if (c == '*' && next == '/') {
                    state = Code;
                    ++i;
                } else if (c == '\n') {
                    out += c;
                }
                break;
            case String:
                if (c == '"' || c == '\n') state = Code;
                out += c;
                break;
        }
    }
    return out;
}

namespace {

class Words {
  public:
    explicit Words(std::string_view line) : rest_(line) {}
    std::string_view next() {
        size_t i = 0;
        while (i < rest_.size() && std::isspace(static_cast<unsigned char>(rest_[i]))) ++i;
        rest_.remove_prefix(i);
        if (rest_.empty()) return {};
        size_t n = 0;
        while (n < rest_.size() && (std::isalnum(static_cast<unsigned char>(rest_[n])) || rest_[n] == '_'))
            ++n;
        if (n == 0) n = 1;
        const std::string_view word = rest_.substr(0, n);
        rest_.remove_prefix(n);
        return word;
    }

  private:
    std::string_view rest_;
};

void scan_directive(std::string_view line, uint32_t number, SourceFacts& facts) {
    Words words(line);
    if (words.next() != "#") return;
    const std::string_view directive = words.next();
    if (directive == "version") {
        const std::string_view version = words.next();
        std::from_chars(version.data(), version.data() + version.size(), facts.version);
        facts.profile = std::string(words.next());
        facts.version_line = number;
    } else if (directive == "extension") {
        const std::string_view name = words.next();
        if (name == "GL_NV_ray_tracing") facts.names_nv = true;
        if (name.substr(0, 18) == "GL_EXT_ray_tracing" || name == "GL_EXT_ray_query" ||
            name == "GL_EXT_ray_flags_primitive_culling" || name == "GL_EXT_ray_cull_mask")
            facts.names_ext = true;
    } else if (directive == "pragma" && words.next() == "shader_stage") {
        if (words.next() != "(") return;
        facts.stage_pragmas.push_back({std::string(words.next()), number});
    }
}

}  // namespace

SourceFacts scan_source(std::string_view text) {
    SourceFacts facts;
    const std::string code = strip_comments(text);
    uint32_t number = 1;
    size_t begin = 0;
    while (begin < code.size()) {
        size_t end = code.find('\n', begin);
        if (end == std::string::npos) end = code.size();
        scan_directive(std::string_view(code).substr(begin, end - begin), number++, facts);
        begin = end + 1;
    }
    return facts;
}

}  // namespace rtc
