#include "frontend/capture/dc1394/process/library_log.h"

#include <dc1394/log.h>

#include <utility>

namespace relmap::iidc::dc1394 {

namespace {

thread_local std::string last_words;

void keep(dc1394log_t, const char* message, void*) {
  last_words = message;
  while (!last_words.empty() && last_words.back() == '\n') last_words.pop_back();
}

void forget(dc1394log_t, const char*, void*) {}

}  // namespace

void keep_library_log() {
  dc1394_log_register_handler(DC1394_LOG_ERROR, &keep, nullptr);
  dc1394_log_register_handler(DC1394_LOG_WARNING, &forget, nullptr);
  dc1394_log_register_handler(DC1394_LOG_DEBUG, &forget, nullptr);
}

std::string library_words() { return std::exchange(last_words, {}); }

Status library_error(Reason reason, const std::string& what) {
  const std::string said = library_words();
  return {reason, said.empty() ? what : what + " (" + said + ")"};
}

}  // namespace relmap::iidc::dc1394
