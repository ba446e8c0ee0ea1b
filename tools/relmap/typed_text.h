// Texts that users type in a form of their own, as frames and times. One that has not this form is wrong usage: the
// command ends before it asks the daemon anything.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <utility>

namespace relmap::cli {

// A check for an option whose text is parsed later: `parse` takes the text and returns a Result.
template <typename Parse>
CLI::Validator parsed_by(Parse parse) {
  return {[parse = std::move(parse)](std::string& text) { return parse(text).status().message(); }, ""};
}

}  // namespace relmap::cli
