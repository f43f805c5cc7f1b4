#include "inputs.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

#include "error.h"
#include "rtc/compiler.h"

namespace cli {

std::string read_input(const std::string& path) {
    if (path == "-") return {std::istreambuf_iterator<char>(std::cin), std::istreambuf_iterator<char>()};
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored))
        throw InputError("rtc: error: cannot open input file: '" + path + "': is a directory");
    errno = 0;
    std::ifstream stream(path, std::ios::binary);
    if (!stream)
        throw InputError("rtc: error: cannot open input file: '" + path +
                         "': " + std::strerror(errno ? errno : ENOENT));
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::string last_component(const std::string& path) {
    const size_t slash = path.find_last_of("/\\");
    return slash == std::string::npos ? path : path.substr(slash + 1);
}

std::shared_ptr<const SourceFile> SourceFiles::open(const std::string& path) {
    const auto known = open_.find(path);
    if (known != open_.end()) return known->second;

    auto file = std::make_shared<SourceFile>();
    file->name = path == "-" ? "<stdin>" : path;
    file->bytes = read_input(path);
    const bool named_spirv = path.size() > 4 && path.compare(path.size() - 4, 4, ".spv") == 0;
    file->is_spirv = named_spirv || rtcc_is_spirv(file->bytes.data(), file->bytes.size());
    if (file->is_spirv) {
        rtcc_result_t module =
            rtcc_module_from_bytes(file->name.c_str(), file->bytes.data(), file->bytes.size());
        const bool ok = rtcc_result_status(module) == RTCC_STATUS_SUCCESS;
        if (ok)
            file->words.assign(rtcc_result_words(module),
                               rtcc_result_words(module) + rtcc_result_word_count(module));
        std::string message = rtcc_result_messages(module);
        rtcc_result_release(module);
        while (!message.empty() && message.back() == '\n') message.pop_back();
        if (!ok) throw InputError(message);
    }
    open_[path] = file;
    return file;
}

}  // namespace cli
