// What the programs throw and how they report it.
#pragma once

#include <vulkan/vulkan.h>

#include <functional>
#include <stdexcept>
#include <string>

namespace rtc::tools {

// A problem the user can read and act on; programs print it and exit with 1.
class Error : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

// The device lacks a feature that a module needs; the text names it.
class MissingFeature : public Error {
    using Error::Error;
};

// Throws an Error naming the call and the result unless the result is VK_SUCCESS.
void check(VkResult result, const char* call);
const char* result_name(VkResult result);

// Runs a program's body: an exception becomes "PROGRAM: error: text" on stderr and exit code 1.
int run_program(const char* program, const std::function<int()>& body);

}  // namespace rtc::tools
