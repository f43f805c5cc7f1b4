#include <cctype>
#include <fstream>
#include <iterator>

#include "arguments.h"
#include "error.h"

namespace cli {
namespace {

// A response file that names itself must end somewhere.
constexpr int kMaxNesting = 10;

std::vector<std::string> split(const std::string& text, const std::string& file) {
    std::vector<std::string> words;
    std::string word;
    bool inside = false;
    char quote = '\0';
    size_t line = 1, opened = 0;  // where the quote began
    for (size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '\n') ++line;
        if (c == '\\' && quote != '\'' && i + 1 < text.size()) {
            word += text[++i];
            if (text[i] == '\n') ++line;
            inside = true;
        } else if (quote) {
            if (c == quote)
                quote = '\0';
            else
                word += c;
        } else if (c == '"' || c == '\'') {
            quote = c;
            opened = line;
            inside = true;
        } else if (std::isspace(static_cast<unsigned char>(c))) {
            if (inside) words.push_back(word);
            word.clear();
            inside = false;
        } else {
            word += c;
            inside = true;
        }
    }
    if (quote)
        throw UsageError(file + ":" + std::to_string(opened) + ": error: a quote (" + quote +
                         ") that begins here is not closed");
    if (inside) words.push_back(word);
    return words;
}

void expand(const std::vector<std::string>& words, int nesting, std::vector<std::string>& out) {
    for (const std::string& word : words) {
        if (word.size() < 2 || word[0] != '@') {
            out.push_back(word);
            continue;
        }
        if (nesting == kMaxNesting) throw UsageError("response files are nested too deeply: '" + word + "'");
        std::ifstream stream(word.substr(1), std::ios::binary);
        if (!stream) throw UsageError("cannot open response file: '" + word.substr(1) + "'");
        const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
        expand(split(text, word.substr(1)), nesting + 1, out);
    }
}

}  // namespace

std::vector<std::string> expand_response_files(const std::vector<std::string>& words) {
    std::vector<std::string> out;
    expand(words, 0, out);
    return out;
}

}  // namespace cli
