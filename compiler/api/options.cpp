#include <cctype>
#include <string_view>

#include "api/objects.h"

namespace {

bool is_identifier(const char* name) {
    if (!name || !(std::isalpha(static_cast<unsigned char>(*name)) || *name == '_')) return false;
    for (; *name; ++name)
        if (!std::isalnum(static_cast<unsigned char>(*name)) && *name != '_') return false;
    return true;
}

// "F(x)" for function-like macros: the name alone must be an identifier.
bool is_macro_name(const char* name) {
    if (!name) return false;
    const std::string_view text(name);
    const size_t paren = text.find('(');
    if (paren == std::string_view::npos) return is_identifier(name);
    return is_identifier(std::string(text.substr(0, paren)).c_str()) && text.back() == ')' &&
           text.find('\n') == std::string_view::npos;
}

template <typename F>
rtcc_status set(rtcc_options_t options, F&& change) {
    if (!options) return RTCC_STATUS_INVALID_ARGUMENT;
    return rtcc::guarded([&] { return change(*options); });
}

}  // namespace

extern "C" {

rtcc_options_t rtcc_options_create(void) { return new (std::nothrow) rtcc_options; }

rtcc_options_t rtcc_options_clone(rtcc_const_options_t options) {
    try {
        return options ? new rtcc_options(*options) : new rtcc_options;
    } catch (...) {
        return nullptr;
    }
}

void rtcc_options_release(rtcc_options_t options) { delete options; }

rtcc_status rtcc_options_add_macro(rtcc_options_t options, const char* name, const char* value) {
    return set(options, [&](rtcc_options& o) {
        const std::string_view text = value ? value : "";
        if (!is_macro_name(name) || text.find('\n') != std::string_view::npos)
            return RTCC_STATUS_INVALID_ARGUMENT;
        // GLSL forbids redefinition with another value; the last -D wins.
        std::erase_if(o.frontend.macros, [&](const rtc::Macro& m) { return m.name == name; });
        o.frontend.macros.push_back({name, std::string(text)});
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_undefine_macro(rtcc_options_t options, const char* name) {
    return set(options, [&](rtcc_options& o) {
        if (!is_identifier(name)) return RTCC_STATUS_INVALID_ARGUMENT;
        std::erase_if(o.frontend.macros, [&](const rtc::Macro& m) { return m.name == name; });
        o.frontend.macros.push_back({name, std::nullopt});
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_add_include_directory(rtcc_options_t options, const char* path) {
    return set(options, [&](rtcc_options& o) {
        if (!path) return RTCC_STATUS_INVALID_ARGUMENT;
        o.frontend.include_directories.emplace_back(path);
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_include_callbacks(rtcc_options_t options, rtcc_include_resolve_fn resolve,
                                               rtcc_include_release_fn release, void* user_data) {
    return set(options, [&](rtcc_options& o) {
        if (!resolve && release) return RTCC_STATUS_INVALID_ARGUMENT;
        o.resolve = resolve;
        o.release = release;
        o.include_user_data = user_data;
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_glsl_version(rtcc_options_t options, const char* version) {
    return set(options, [&](rtcc_options& o) {
        int number = 0;
        std::string profile;
        if (version && *version && !rtc::parse_glsl_version(version, number, profile))
            return RTCC_STATUS_INVALID_ARGUMENT;
        o.frontend.glsl_version = version ? version : "";
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_debug_info(rtcc_options_t options, int enable) {
    return set(options, [&](rtcc_options& o) {
        o.link.debug_info = enable != 0;
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_optimization(rtcc_options_t options, rtcc_optimization level) {
    return set(options, [&](rtcc_options& o) {
        switch (level) {
            case RTCC_OPTIMIZATION_NONE:
                o.link.optimize = rtc::Optimization::None;
                break;
            case RTCC_OPTIMIZATION_PERFORMANCE:
                o.link.optimize = rtc::Optimization::Performance;
                break;
            case RTCC_OPTIMIZATION_SIZE:
                o.link.optimize = rtc::Optimization::Size;
                break;
            default:
                return RTCC_STATUS_INVALID_ARGUMENT;
        }
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_accuracy(rtcc_options_t options, rtcc_accuracy accuracy) {
    return set(options, [&](rtcc_options& o) {
        switch (accuracy) {
            case RTCC_ACCURACY_WATERTIGHT:
                o.link.accuracy = rtc::Accuracy::Watertight;
                break;
            case RTCC_ACCURACY_FAST:
                o.link.accuracy = rtc::Accuracy::Fast;
                break;
            case RTCC_ACCURACY_EXACT:
                o.link.accuracy = rtc::Accuracy::Exact;
                break;
            case RTCC_ACCURACY_EXACT_FLOAT64:
                o.link.accuracy = rtc::Accuracy::ExactFloat64;
                break;
            default:
                return RTCC_STATUS_INVALID_ARGUMENT;
        }
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_target_env(rtcc_options_t options, rtcc_target_env target) {
    return set(options, [&](rtcc_options& o) {
        switch (target) {
            case RTCC_TARGET_AUTO:
                o.link.target = rtc::TargetEnv::Auto;
                break;
            case RTCC_TARGET_VULKAN_1_1:
                o.link.target = rtc::TargetEnv::Vulkan11;
                break;
            case RTCC_TARGET_VULKAN_1_2:
                o.link.target = rtc::TargetEnv::Vulkan12;
                break;
            case RTCC_TARGET_VULKAN_1_3:
                o.link.target = rtc::TargetEnv::Vulkan13;
                break;
            default:
                return RTCC_STATUS_INVALID_ARGUMENT;
        }
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_max_recursion_depth(rtcc_options_t options, uint32_t depth) {
    return set(options, [&](rtcc_options& o) {
        if (depth < 1 || depth > 31) return RTCC_STATUS_INVALID_ARGUMENT;
        o.link.max_recursion_depth = depth;
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_max_callable_depth(rtcc_options_t options, uint32_t depth) {
    return set(options, [&](rtcc_options& o) {
        if (depth > 31) return RTCC_STATUS_INVALID_ARGUMENT;
        o.link.max_callable_depth = depth;
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_reserved(rtcc_options_t options, int32_t set_number, uint32_t binding) {
    return set(options, [&](rtcc_options& o) {
        if (set_number < -1) return RTCC_STATUS_INVALID_ARGUMENT;
        o.link.reserved_set = set_number;
        o.link.reserved_binding = binding;
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_validate(rtcc_options_t options, int enable) {
    return set(options, [&](rtcc_options& o) {
        o.link.validate = enable != 0;
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_addressing(rtcc_options_t options, rtcc_addressing addressing) {
    return set(options, [&](rtcc_options& o) {
        if (addressing != RTCC_ADDRESSING_HEAP && addressing != RTCC_ADDRESSING_ADDRESS)
            return RTCC_STATUS_INVALID_ARGUMENT;
        o.link.addressing =
            addressing == RTCC_ADDRESSING_ADDRESS ? rtc::Addressing::Address : rtc::Addressing::Heap;
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_compat(rtcc_options_t options, rtcc_compat compat) {
    return set(options, [&](rtcc_options& o) {
        if (compat != RTCC_COMPAT_NONE && compat != RTCC_COMPAT_GDC2019) return RTCC_STATUS_INVALID_ARGUMENT;
        o.frontend.gdc2019 = compat == RTCC_COMPAT_GDC2019;
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_checked(rtcc_options_t options, int enable) {
    return set(options, [&](rtcc_options& o) {
        o.link.checked = enable != 0;
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_resumable(rtcc_options_t options, int enable) {
    return set(options, [&](rtcc_options& o) {
        o.link.resumable = enable != 0;
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_warnings_as_errors(rtcc_options_t options, int enable) {
    return set(options, [&](rtcc_options& o) {
        o.warnings_as_errors = enable != 0;
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_suppress_warnings(rtcc_options_t options, int enable) {
    return set(options, [&](rtcc_options& o) {
        o.suppress_warnings = enable != 0;
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_options_set_stop_after(rtcc_options_t options, const char* pass) {
    return set(options, [&](rtcc_options& o) {
        o.link.stop_after = pass ? pass : "";
        return RTCC_STATUS_SUCCESS;
    });
}

}  // extern "C"
