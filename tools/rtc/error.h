// What stops the program: a mistake on the command line (exit status 2) or one in
// what it names (exit status 1).
#pragma once

#include <stdexcept>
#include <string>

namespace cli {

struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// Printed as it stands, so it carries its own "file:line:column: error:" when it has one.
struct InputError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

}  // namespace cli
