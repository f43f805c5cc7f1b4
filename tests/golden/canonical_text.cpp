// Makes a dump say only what the core decided: functions, and the globals they use in the order of use.
#include <cctype>
#include <map>
#include <set>
#include <sstream>

#include "golden_case.h"

namespace rtc::test {
namespace {

struct Line {
    std::string result;  // "%x", or empty
    std::vector<std::string> words;
};

Line parse(const std::string& text) {
    Line line;
    std::istringstream in(text);
    std::string word;
    while (in >> word) {
        if (word.front() == '"')  // a string to its end
            while (word.size() < 2 || word.back() != '"') {
                std::string more;
                if (!(in >> more)) break;
                word += " " + more;
            }
        line.words.push_back(word);
    }
    if (line.words.size() > 2 && line.words[1] == "=") {
        line.result = line.words[0];
        line.words.erase(line.words.begin(), line.words.begin() + 2);
    }
    return line;
}

class Canonical {
  public:
    explicit Canonical(const std::string& disassembly) {
        std::istringstream in(disassembly);
        std::string text;
        bool function = false;
        while (std::getline(in, text)) {
            if (text.empty() || text.find_first_not_of(' ') == std::string::npos || text[0] == ';') continue;
            Line line = parse(text);
            const std::string& op = line.words[0];
            function |= op == "OpFunction";
            if (function) {
                body_.push_back(line);
            } else if (!line.result.empty()) {
                globals_[line.result] = line;
            } else if (op == "OpDecorate" || op == "OpMemberDecorate") {
                decorations_[line.words[1]].push_back(line);
            }
        }
    }

    std::string text() {
        for (const Line& line : body_) use_all(line);
        std::string out;
        for (const std::string& id : order_)
            for (const Line& decoration : decorations_[id]) out += print(decoration);
        for (const std::string& id : order_) out += print(globals_[id]);
        for (const Line& line : body_) {
            if (line.words[0] == "OpFunction" || line.words[0] == "OpLabel") out += "\n";
            out += print(line);
        }
        return out;
    }

  private:
    void use_all(const Line& line) {
        for (const std::string& word : line.words)
            if (word.front() == '%') use(word);
    }

    void use(const std::string& id) {
        const auto found = globals_.find(id);
        if (found == globals_.end() || !used_.insert(id).second) return;
        use_all(found->second);
        order_.push_back(id);
    }

    // Constants are called by type and value whatever name they came with; nameless ids count from 1.
    std::string name(const std::string& id) {
        const auto known = names_.find(id);
        if (known != names_.end()) return known->second;
        std::string name = id;
        const auto global = globals_.find(id);
        const std::string op = global == globals_.end() ? "" : global->second.words[0];
        if (op == "OpConstantTrue") {
            name = "%true";
        } else if (op == "OpConstantFalse") {
            name = "%false";
        } else if (op == "OpConstant") {
            name = this->name(global->second.words[1]) + "_" + global->second.words[2];
            for (char& c : name)
                if (c == '-' || c == '+' || c == '.') c = c == '-' ? 'n' : '_';
        } else if (std::isdigit(static_cast<unsigned char>(id[1]))) {
            name = "%" + std::to_string(++count_);
        }
        return names_[id] = name;
    }

    std::string print(const Line& line) {
        std::string out = line.result.empty() ? "" : name(line.result) + " = ";
        for (size_t i = 0; i < line.words.size(); ++i) {
            if (i) out += ' ';
            out += line.words[i].front() == '%' ? name(line.words[i]) : line.words[i];
        }
        return out + "\n";
    }

    std::vector<Line> body_;
    std::map<std::string, Line> globals_;
    std::map<std::string, std::vector<Line>> decorations_;
    std::set<std::string> used_;
    std::vector<std::string> order_;
    std::map<std::string, std::string> names_;
    unsigned count_ = 0;
};

}  // namespace

std::string canonical_text(const std::string& disassembly) {
    // A dump that could not be disassembled is kept as it is: it holds the reason.
    if (disassembly.find("OpFunction") == std::string::npos) return disassembly;
    return Canonical(disassembly).text();
}

}  // namespace rtc::test
