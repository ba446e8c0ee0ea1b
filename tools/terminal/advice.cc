#include "tools/terminal/advice.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string_view>

namespace relmap::terminal {

namespace {

constexpr std::uint16_t kFirstOfTheDaemon = 100, kFirstOfACamera = 140;  // groups of proto/base/reason.h
constexpr const char* kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ_";

std::optional<Reason> operational_named(std::string_view name) {
  for (std::uint16_t number = 0; number < kFirstOfACamera; ++number)
    if (is_reason(number) && reason_name(static_cast<Reason>(number)) == name &&
        is_operational(static_cast<Reason>(number)))
      return static_cast<Reason>(number);
  return std::nullopt;
}

}  // namespace

bool is_operational(Reason reason) {
  switch (reason) {
    // What robots send or are told, that an operator has to settle.
    case Reason::SEQUENCE_CONFLICT:
    case Reason::NOT_ALLOWED:
    case Reason::RATE_LIMITED:
    case Reason::SESSION_FROZEN:
    case Reason::SESSION_DELETED:
    case Reason::WRONG_CALIBRATION:
      return true;
    // Of the daemon, but it is the caller's to ask otherwise.
    case Reason::UNIMPLEMENTED:
    case Reason::VIEW_EXPIRED:
    case Reason::DEADLINE:
    case Reason::SHUTTING_DOWN:
    case Reason::NO_SUCH_FILE:
    case Reason::UNSUPPORTED:
      return false;
    default:
      return static_cast<std::uint16_t>(reason) >= kFirstOfTheDaemon &&
             static_cast<std::uint16_t>(reason) < kFirstOfACamera;
  }
}

std::string advice_on(const std::vector<Reason>& reasons) {
  std::vector<Reason> named;
  std::string text;
  for (const Reason reason : reasons) {
    if (!is_operational(reason) || std::find(named.begin(), named.end(), reason) != named.end()) continue;
    named.push_back(reason);
    text += " " + std::string(reason_name(reason));
  }
  return named.empty() ? text : "relmap-admin explain" + text + " tells what to do";
}

std::vector<Reason> operational_in(const std::string& text) {
  std::vector<Reason> found;
  for (std::size_t at = text.find_first_of(kLetters); at != std::string::npos;) {
    const std::size_t end = std::min(text.find_first_not_of(kLetters, at), text.size());
    if (const auto reason = operational_named(std::string_view(text).substr(at, end - at))) found.push_back(*reason);
    at = text.find_first_of(kLetters, end);
  }
  return found;
}

}  // namespace relmap::terminal
