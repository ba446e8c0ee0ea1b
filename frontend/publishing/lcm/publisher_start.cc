#include <utility>

#include "frontend/publishing/lcm/lcm_transport.h"
#include "frontend/publishing/publisher.h"

namespace relmap::publishing {

Result<std::unique_ptr<Publisher>> Publisher::start(PublisherOptions options, SessionHeader header) {
  const Result<std::string> url = complete_lcm_url(options.lcm_url);
  if (!url.ok()) return url.status();
  Result<std::unique_ptr<LcmTransport>> transport = LcmTransport::open(*url);
  if (!transport.ok()) return transport.status();
  return start(std::move(options), std::move(header), std::move(*transport));
}

}  // namespace relmap::publishing
