// JSON as text, written key by key: what nlohmann::json would print of the same values, without the tree that it
// builds first (which took longer than the states of a small pipeline).
#pragma once

#include <charconv>
#include <concepts>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace rtc {

class JsonWriter {
  public:
    // Two spaces a level, or all on one line.
    explicit JsonWriter(bool pretty) : pretty_(pretty) {}

    void begin_object() { begin('{'); }
    void end_object() { end('}'); }
    void begin_array() { begin('['); }
    void end_array() { end(']'); }
    // Before each value of an object.
    void key(std::string_view name) {
        separate();
        quote(name);
        text_ += pretty_ ? ": " : ":";
        after_key_ = true;
    }
    void value(std::string_view text) {
        separate();
        quote(text);
    }
    void value(std::integral auto number) {
        separate();
        char digits[24];
        text_.append(digits, std::to_chars(digits, digits + sizeof digits, number).ptr);
    }
    void value(const std::vector<std::string>& list) {
        begin_array();
        for (const std::string& item : list) value(std::string_view(item));
        end_array();
    }
    template <typename T>
    void member(std::string_view name, const T& content) {
        key(name);
        if constexpr (std::is_integral_v<T> || std::same_as<T, std::vector<std::string>>)
            value(content);
        else
            value(std::string_view(content));
    }
    std::string take() { return std::move(text_); }

  private:
    void begin(char bracket) {
        separate();
        text_ += bracket;
        ++depth_;
        first_ = true;
    }
    void end(char bracket) {
        --depth_;
        if (!first_) new_line();
        text_ += bracket;
        first_ = false;
    }
    void separate() {
        if (after_key_ || depth_ == 0) {
            after_key_ = false;
            return;
        }
        if (!first_) text_ += ',';
        first_ = false;
        new_line();
    }
    void new_line() {
        if (!pretty_) return;
        text_ += '\n';
        text_.append(2 * depth_, ' ');
    }
    void quote(std::string_view text) {
        bool plain = true;
        for (char c : text) plain = plain && c >= ' ' && c < 127 && c != '"' && c != '\\';
        if (plain) {
            text_ += '"';
            text_ += text;
            text_ += '"';
        } else {
            // Names come from SPIR-V, which may hold bytes that are no UTF-8: they become U+FFFD.
            text_ += nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
        }
    }

    std::string text_;
    bool pretty_;
    bool first_ = true;       // nothing stands in the innermost brackets yet
    bool after_key_ = false;
    size_t depth_ = 0;
};

}  // namespace rtc
