#include "api_util.h"

#include <map>
#include <vector>

using ::testing::ElementsAre;
using ::testing::HasSubstr;

namespace {

// Files in memory; counts what is out.
struct Library {
    std::map<std::string, std::string> files;
    std::vector<std::string> asked;
    int out = 0;

    struct Answer {
        rtcc_include_result result;
        std::string name, content;
    };

    static rtcc_include_result* resolve(void* user, const char* requested, rtcc_include_type type,
                                        const char* includer, size_t depth) {
        auto* self = static_cast<Library*>(user);
        self->asked.push_back(std::string(type == RTCC_INCLUDE_QUOTED ? "\"" : "<") + requested + " from " +
                              includer + " at " + std::to_string(depth));
        auto* answer = new Answer;
        const auto found = self->files.find(requested);
        if (found != self->files.end()) {
            answer->name = "mem/" + found->first;
            answer->content = found->second;
        } else {
            answer->content = "the library has no such file";
        }
        answer->result = {answer->name.c_str(), answer->name.size(), answer->content.c_str(),
                          answer->content.size(), answer};
        ++self->out;
        return &answer->result;
    }
    static void release(void* user, rtcc_include_result* result) {
        --static_cast<Library*>(user)->out;
        delete static_cast<Answer*>(result->user_data);
    }
};

const std::string kSource =
    "#version 460\n#extension GL_NV_ray_tracing : require\n#include \"a.glsl\"\nvoid main() { f(); }\n";

TEST(Include, CallbacksResolveNestedIncludes) {
    Library library;
    library.files = {{"a.glsl", "#include <b.glsl>\nvoid f() { g(); }\n"}, {"b.glsl", "void g() {}\n"}};
    Options options(rtcc_options_create());
    ASSERT_EQ(rtcc_options_set_include_callbacks(options.get(), Library::resolve, Library::release, &library),
              RTCC_STATUS_SUCCESS);
    const Result result = compile_stage(kSource, "top.rmiss", options.get());
    EXPECT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_SUCCESS) << rtcc_result_messages(result.get());
    EXPECT_THAT(library.asked, ElementsAre("\"a.glsl from top.rmiss at 1", "<b.glsl from mem/a.glsl at 2"));
    EXPECT_EQ(library.out, 0) << "everything handed out was taken back";
    ASSERT_EQ(rtcc_result_dependency_count(result.get()), 3u);
    EXPECT_STREQ(rtcc_result_dependency(result.get(), 1), "mem/a.glsl");
    EXPECT_STREQ(rtcc_result_dependency(result.get(), 2), "mem/b.glsl");
}

TEST(Include, ErrorsNameTheResolvedFile) {
    Library library;
    library.files = {{"a.glsl", "\n\nvoid f() { nothing(); }\n"}};
    Options options(rtcc_options_create());
    rtcc_options_set_include_callbacks(options.get(), Library::resolve, Library::release, &library);
    const Result result = compile_stage(kSource, "top.rmiss", options.get());
    EXPECT_STREQ(rtcc_result_diagnostic(result.get(), 0).file, "mem/a.glsl");
    EXPECT_EQ(rtcc_result_diagnostic(result.get(), 0).line, 3u);
}

TEST(Include, TheCallbacksReasonIsReported) {
    Library library;
    Options options(rtcc_options_create());
    rtcc_options_set_include_callbacks(options.get(), Library::resolve, Library::release, &library);
    const Result result = compile_stage(kSource, "top.rmiss", options.get());
    EXPECT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_COMPILATION_ERROR);
    EXPECT_THAT(rtcc_result_messages(result.get()), HasSubstr("top.rmiss:3: error: "));
    EXPECT_THAT(rtcc_result_messages(result.get()), HasSubstr("the library has no such file"));
    EXPECT_EQ(library.out, 0);
}

TEST(Include, ACallbackMayReturnNothing) {
    Options options(rtcc_options_create());
    const auto nothing = [](void*, const char*, rtcc_include_type, const char*,
                            size_t) -> rtcc_include_result* { return nullptr; };
    rtcc_options_set_include_callbacks(options.get(), nothing, nullptr, nullptr);
    EXPECT_EQ(rtcc_result_status(compile_stage(kSource, "top.rmiss", options.get()).get()),
              RTCC_STATUS_COMPILATION_ERROR);
}

TEST(Include, AnIncludeMayChooseTheDialect) {
    Library library;
    library.files = {{"a.glsl", "#extension GL_EXT_ray_tracing : require\nvoid f() {}\n"}};
    Options options(rtcc_options_create());
    rtcc_options_set_include_callbacks(options.get(), Library::resolve, Library::release, &library);
    const std::string source =
        "#version 460\n#include \"a.glsl\"\n"
        "layout(location = 0) rayPayloadInEXT vec4 color;\nvoid main() { f(); }\n";
    const Result result = compile_stage(source, "top.rmiss", options.get());
    ASSERT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_SUCCESS) << rtcc_result_messages(result.get());
    EXPECT_EQ(rtcc_result_words(result.get())[1], 0x00010400u);
    EXPECT_EQ(library.out, 0);
}

}  // namespace
