#include "frontend/compat.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <string_view>
#include <vector>

namespace rtc {
namespace {

struct Token {
    size_t begin = 0, end = 0;
    std::string_view text;
    int depth = 0;  // braces around it
};

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

// Code without comments and preprocessor lines.
std::vector<Token> tokenize(const std::string& s) {
    std::vector<Token> out;
    int depth = 0;
    bool line_start = true;
    for (size_t i = 0; i < s.size();) {
        const char c = s[i];
        if (c == '\n') {
            line_start = true;
            ++i;
        } else if (std::isspace(static_cast<unsigned char>(c))) {
            ++i;
        } else if (c == '/' && i + 1 < s.size() && s[i + 1] == '/') {
            while (i < s.size() && s[i] != '\n') ++i;
        } else if (c == '/' && i + 1 < s.size() && s[i + 1] == '*') {
            const size_t end = s.find("*/", i + 2);
            i = end == std::string::npos ? s.size() : end + 2;
        } else if (c == '#' && line_start) {
            while (i < s.size() && (s[i] != '\n' || s[i - 1] == '\\')) ++i;
        } else {
            line_start = false;
            Token token;
            token.begin = i;
            if (is_word(c)) {
                while (i < s.size() && is_word(s[i])) ++i;
            } else {
                ++i;
            }
            token.end = i;
            token.text = std::string_view(s).substr(token.begin, token.end - token.begin);
            if (token.text == "}" && depth > 0) --depth;
            token.depth = depth;
            if (token.text == "{") ++depth;
            out.push_back(token);
        }
    }
    return out;
}

bool is_block_qualifier(std::string_view word) {
    static const std::set<std::string_view> words{"uniform",        "buffer",         "rayPayloadNV",
                                                  "rayPayloadInNV", "hitAttributeNV", "callableDataNV",
                                                  "callableDataInNV", "shaderRecordNV"};
    return words.count(word) != 0;
}

bool is_opaque_type(std::string_view word) {
    if (word == "accelerationStructureNV" || word == "sampler" || word == "samplerShadow") return true;
    if (!word.empty() && (word[0] == 'i' || word[0] == 'u') && word.substr(0, 5) != "image") word.remove_prefix(1);
    for (std::string_view kind : {"image", "sampler", "texture"})
        if (word.substr(0, kind.size()) == kind)
            for (std::string_view dimension : {"1D", "2D", "3D", "Cube", "Buffer"})
                if (word.substr(kind.size(), dimension.size()) == dimension) return true;
    return false;
}

bool is_memory_qualifier(std::string_view word) {
    static const std::set<std::string_view> words{"coherent", "volatile", "restrict", "readonly", "writeonly",
                                                  "highp",    "mediump",  "lowp"};
    return words.count(word) != 0;
}

class Translator {
  public:
    explicit Translator(const std::string& source) : source_(source), tokens_(tokenize(source)) {}

    std::string run() {
        // Bodies of blocks and structs declare members; they use none.
        declares_.resize(tokens_.size());
        for (size_t i = 2; i < tokens_.size(); ++i)
            if (tokens_[i].depth == 0 && text(i) == "{" &&
                (is_block_qualifier(text(i - 2)) || text(i - 2) == "struct"))
                for (size_t k = i + 1; k < tokens_.size() && tokens_[k].depth > 0; ++k) declares_[k] = true;
        for (size_t i = 0; i < tokens_.size(); ++i) {
            if (text(i) == "gl_GlobalInvocationIDNV") replace(i, "gl_LaunchIDNV");
            if (text(i) == "gl_hitTNV") replace(i, "gl_HitTNV");
            if (tokens_[i].depth != 0) continue;
            if (text(i) == "layout") add_uniform(i);
            if (text(i) == "{" && i >= 2 && is_word(text(i - 1)[0]) && is_block_qualifier(text(i - 2))) block(i);
        }
        std::string out = source_;
        std::sort(edits_.begin(), edits_.end(), [](const Edit& a, const Edit& b) { return a.begin > b.begin; });
        for (const Edit& edit : edits_) out.replace(edit.begin, edit.end - edit.begin, edit.text);
        return out;
    }

  private:
    struct Edit {
        size_t begin, end;
        std::string text;
    };

    std::string_view text(size_t i) const { return i < tokens_.size() ? tokens_[i].text : std::string_view(); }
    void replace(size_t i, const std::string& with) { edits_.push_back({tokens_[i].begin, tokens_[i].end, with}); }
    void insert(size_t at, const std::string& what) { edits_.push_back({at, at, what}); }

    // layout(..., binding = ...) image2D name
    void add_uniform(size_t i) {
        if (text(i + 1) != "(") return;
        bool binding = false;
        size_t at = i + 2;
        for (; at < tokens_.size() && text(at) != ")"; ++at) binding |= text(at) == "binding";
        ++at;
        while (is_memory_qualifier(text(at))) ++at;
        if (binding && is_opaque_type(text(at))) insert(tokens_[at].begin, "uniform ");
    }

    void block(size_t open) {
        const std::string name(text(open - 1));
        std::set<std::string_view> members;
        size_t close = open + 1;
        for (; close < tokens_.size() && tokens_[close].depth > 0; ++close)
            if (tokens_[close].depth == 1 && (text(close + 1) == ";" || text(close + 1) == "," || text(close + 1) == "["))
                if (is_word(text(close)[0]) && !std::isdigit(static_cast<unsigned char>(text(close)[0])))
                    members.insert(text(close));
        if (close >= tokens_.size()) return;
        const std::string_view next = text(close + 1);
        if (!next.empty() && is_word(next[0]) && (text(close + 2) == ";" || text(close + 2) == "[")) return;  // instanced
        std::vector<size_t> dotted;
        bool bare = false;
        for (size_t i = 0; i < tokens_.size(); ++i) {
            if (declares_[i]) continue;
            const bool member_access = i > 0 && text(i - 1) == ".";
            if (!member_access && text(i) == name && text(i + 1) == "." && members.count(text(i + 2)))
                dotted.push_back(i);
            else if (!member_access && i + 1 != open && members.count(text(i)))
                bare = true;
        }
        std::string after;
        if (!dotted.empty() && !bare) {
            // The block gets an instance, and that is what was meant.
            after = " rtc_" + name;
            for (size_t i : dotted) replace(i, "rtc_" + name);
        } else {
            // Its members are used by their own names too: those are global then.
            for (size_t i : dotted) edits_.push_back({tokens_[i].begin, tokens_[i + 1].end, ""});
        }
        if (next != ";") after += ";";
        if (!after.empty()) insert(tokens_[close].end, after);
    }

    const std::string& source_;
    std::vector<Token> tokens_;
    std::vector<Edit> edits_;
    std::vector<bool> declares_;
};

}  // namespace

std::string translate_gdc2019(const std::string& source) { return Translator(source).run(); }

}  // namespace rtc
