#include "frontend/workflow/daemon_silence.h"

#include <utility>

namespace relmap::workflow {

bool is_refusal(const Status& trouble) {
  return trouble.reason() == Reason::UNAUTHENTICATED || trouble.reason() == Reason::NOT_ALLOWED;
}

std::string silence_of(const std::string& daemon, const std::string& what, const Status& trouble) {
  return what + " on " + daemon + (trouble.ok() ? "" : " (" + trouble.to_string() + ")");
}

DaemonSilence::DaemonSilence(Options options, Time begin) : options_(std::move(options)), silent_since_(begin) {}

std::optional<std::string> DaemonSilence::look(Time now, bool heard, const Status& trouble) {
  const bool wrong_map = options_.live && trouble.reason() == Reason::WRONG_MAP;
  const bool refused = is_refusal(trouble);
  if (heard && trouble.ok()) {
    silent_since_.reset();
    if (std::exchange(told_, false)) return "relmapd answers on " + options_.daemon;
  } else if (!silent_since_) {
    silent_since_ = now;
  } else if (!told_ && (wrong_map || now > *silent_since_ + options_.patience)) {
    told_ = true;
    const char* const what = wrong_map ? "nothing is sent"
                             : refused ? "relmapd takes nothing"
                             : heard   ? "relmapd does not answer any more"
                                       : "no relmapd has answered";
    return silence_of(options_.daemon, what, trouble) + "; keyframes wait in " +
           (options_.kept_in.empty() ? "memory" : options_.kept_in) +
           (wrong_map ? " for their own map; another --session begins one in this map" : "");
  }
  return {};
}

}  // namespace relmap::workflow
