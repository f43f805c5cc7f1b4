#include "json.h"

#include <cctype>
#include <cstdint>

#include "error.h"

namespace cli {
namespace {

constexpr int kMaxDepth = 100;  // far above any pipeline file; the parser recurses

class Parser {
  public:
    Parser(const std::string& text, const std::string& file) : text_(text), file_(file) {
        if (text_.compare(0, 3, "\xEF\xBB\xBF") == 0) at_ = 3;
    }

    JsonValue document() {
        JsonValue value = parse_value(0);
        blanks();
        if (at_ < text_.size()) fail("expected the end of the file");
        return value;
    }

  private:
    [[noreturn]] void fail(const std::string& what) const { json_error(file_, place_, what); }

    char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }

    char take() {
        const char c = text_[at_++];
        if (c == '\n') {
            ++place_.line;
            place_.column = 1;
        } else if ((static_cast<unsigned char>(c) & 0xc0) != 0x80) {
            ++place_.column;  // columns count characters, not UTF-8 bytes
        }
        return c;
    }

    void blanks() {
        while (peek() == ' ' || peek() == '\t' || peek() == '\n' || peek() == '\r') take();
    }

    void expect(char c, const char* what) {
        blanks();
        if (peek() != c || at_ >= text_.size()) fail(std::string("expected ") + what);
        take();
    }

    JsonValue parse_value(int depth) {
        if (depth > kMaxDepth) fail("nested too deeply");
        blanks();
        JsonValue value;
        value.place = place_;
        const char c = peek();
        if (c == '{')
            parse_object(value, depth);
        else if (c == '[')
            parse_array(value, depth);
        else if (c == '"') {
            value.kind = JsonValue::Kind::String;
            value.text = parse_string();
        } else if (c == '-' || std::isdigit(static_cast<unsigned char>(c)))
            parse_number(value);
        else if (std::isalpha(static_cast<unsigned char>(c)))
            parse_word(value);
        else
            fail(at_ < text_.size() ? "expected a value" : "unexpected end of the file");
        return value;
    }

    void parse_object(JsonValue& value, int depth) {
        value.kind = JsonValue::Kind::Object;
        take();
        blanks();
        if (peek() == '}') {
            take();
            return;
        }
        for (;;) {
            blanks();
            JsonValue::Member member;
            member.place = place_;
            if (peek() != '"') fail("expected a member's name in quotes");
            member.name = parse_string();
            for (const JsonValue::Member& other : value.members)
                if (other.name == member.name)
                    json_error(file_, member.place, "duplicate name \"" + member.name + "\"");
            expect(':', "':'");
            member.value = parse_value(depth + 1);
            value.members.push_back(std::move(member));
            blanks();
            if (peek() != ',') break;
            take();
        }
        expect('}', "',' or '}'");
    }

    void parse_array(JsonValue& value, int depth) {
        value.kind = JsonValue::Kind::Array;
        take();
        blanks();
        if (peek() == ']') {
            take();
            return;
        }
        for (;;) {
            value.items.push_back(parse_value(depth + 1));
            blanks();
            if (peek() != ',') break;
            take();
        }
        expect(']', "',' or ']'");
    }

    void parse_number(JsonValue& value) {
        value.kind = JsonValue::Kind::Number;
        const auto digits = [&] {
            if (!std::isdigit(static_cast<unsigned char>(peek()))) fail("expected a digit");
            while (std::isdigit(static_cast<unsigned char>(peek()))) value.text += take();
        };
        if (peek() == '-') value.text += take();
        digits();
        if (peek() == '.') {
            value.text += take();
            digits();
        }
        if (peek() == 'e' || peek() == 'E') {
            value.text += take();
            if (peek() == '+' || peek() == '-') value.text += take();
            digits();
        }
    }

    void parse_word(JsonValue& value) {
        const JsonPlace begin = place_;
        while (std::isalpha(static_cast<unsigned char>(peek()))) value.text += take();
        if (value.text == "true" || value.text == "false")
            value.kind = JsonValue::Kind::Bool;
        else if (value.text == "null")
            value.kind = JsonValue::Kind::Null;
        else
            json_error(file_, begin, "expected a value, found '" + value.text + "'");
    }

    uint32_t hex4() {
        uint32_t value = 0;
        for (int i = 0; i < 4; ++i) {
            const char c = peek();
            if (!std::isxdigit(static_cast<unsigned char>(c))) fail("expected four hexadecimal digits");
            take();
            value = value * 16 + static_cast<uint32_t>(std::isdigit(static_cast<unsigned char>(c))
                                                           ? c - '0'
                                                           : (c | 32) - 'a' + 10);
        }
        return value;
    }

    void append_utf8(std::string& out, uint32_t code) {
        if (code < 0x80) {
            out += static_cast<char>(code);
        } else if (code < 0x800) {
            out += static_cast<char>(0xc0 | code >> 6);
            out += static_cast<char>(0x80 | (code & 63));
        } else if (code < 0x10000) {
            out += static_cast<char>(0xe0 | code >> 12);
            out += static_cast<char>(0x80 | (code >> 6 & 63));
            out += static_cast<char>(0x80 | (code & 63));
        } else {
            out += static_cast<char>(0xf0 | code >> 18);
            out += static_cast<char>(0x80 | (code >> 12 & 63));
            out += static_cast<char>(0x80 | (code >> 6 & 63));
            out += static_cast<char>(0x80 | (code & 63));
        }
    }

    std::string parse_string() {
        std::string out;
        take();
        for (;;) {
            if (at_ >= text_.size()) fail("unexpected end of the file in a string");
            const char c = peek();
            if (c == '\n') fail("unexpected end of the line in a string");
            take();
            if (c == '"') return out;
            if (c != '\\') {
                out += c;
                continue;
            }
            if (at_ >= text_.size()) fail("unexpected end of the file in a string");
            const char escape = take();
            switch (escape) {
                case '"':
                case '\\':
                case '/':
                    out += escape;
                    break;
                case 'b':
                    out += '\b';
                    break;
                case 'f':
                    out += '\f';
                    break;
                case 'n':
                    out += '\n';
                    break;
                case 'r':
                    out += '\r';
                    break;
                case 't':
                    out += '\t';
                    break;
                case 'u': {
                    uint32_t code = hex4();
                    if (code >= 0xd800 && code < 0xdc00 && text_.compare(at_, 2, "\\u") == 0) {
                        take();
                        take();
                        const uint32_t low = hex4();
                        if (low < 0xdc00 || low > 0xdfff) fail("half a surrogate pair");
                        code = 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00);
                    } else if (code >= 0xd800 && code < 0xe000) {
                        fail("half a surrogate pair");
                    }
                    append_utf8(out, code);
                    break;
                }
                default:
                    fail(std::string("unknown escape '\\") + escape + "'");
            }
        }
    }

    const std::string& text_;
    const std::string& file_;
    size_t at_ = 0;
    JsonPlace place_;
};

}  // namespace

const char* json_kind_name(JsonValue::Kind kind) {
    switch (kind) {
        case JsonValue::Kind::Null:
            return "null";
        case JsonValue::Kind::Bool:
            return "a bool";
        case JsonValue::Kind::Number:
            return "a number";
        case JsonValue::Kind::String:
            return "a string";
        case JsonValue::Kind::Array:
            return "an array";
        case JsonValue::Kind::Object:
            return "an object";
    }
    return "";
}

void json_error(const std::string& file, JsonPlace place, const std::string& what) {
    throw InputError(file + ":" + std::to_string(place.line) + ":" + std::to_string(place.column) +
                     ": error: " + what);
}

JsonValue parse_json(const std::string& text, const std::string& file) {
    return Parser(text, file).document();
}

}  // namespace cli
