// One row of a table of misuse: what is done, and what the runtime must say to it.
#pragma once

#include <functional>

#include "vulkan_harness.h"

struct Misuse {
    const char* id;
    VkResult result;
    const char* says;  // a part of the text: the limit, or what to do
    std::function<VkResult()> call;
};

// Each call fails with its result and one message of its id and text.
inline void expect_refused(Vulkan& vk, const std::vector<Misuse>& rows) {
    for (auto& row : rows) {
        SCOPED_TRACE(std::string(row.id) + ": " + row.says);
        vk.runtime_messages.clear();
        EXPECT_EQ(row.call(), row.result);
        EXPECT_EQ(vk.runtime_messages.size(), 1u);
        const std::string said = vk.runtime_messages.empty() ? "nothing" : vk.runtime_messages[0];
        EXPECT_EQ(said.find(std::string(row.id) + ": "), 0u) << said;
        EXPECT_NE(said.find(row.says), std::string::npos) << said;
        vk.runtime_messages.clear();
    }
}
