// Any text as a configuration file, and as the address at which a daemon listens: it is refused by name, or gives
// settings that can be checked. A file that is read from the disk is taken as its text is.
#include <string>

#include "proto/base/testing/fuzzing.h"
#include "server/ops/config.h"
#include "storage/testing/temporary_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap;
  using namespace relmap::ops;
  using fuzzing::must;
  const std::string_view text = fuzzing::text_of({data, size});
  Config config;
  const Status parsed = parse_config(text, "relmapd.yaml", config);
  must(parsed.ok() || (parsed.reason() == Reason::BAD_CONFIG && parsed.message().starts_with("relmapd.yaml:")));
  static const storage::TemporaryFolder kFolder;
  const std::string path = kFolder / "relmapd.yaml";
  fuzzing::write_file(path, {data, size});
  Config from_file;
  must(read_config(path, from_file).reason() == parsed.reason() && from_file.lcm == config.lcm);
  must(read_config(kFolder / "other.yaml", from_file).reason() == Reason::NO_SUCH_FILE);

  complete_config(config);
  const Status checked = check_config(config);
  must(checked.ok() || checked.reason() == Reason::BAD_CONFIG);
  must(!config.route_metrics().empty());
  for (const std::string_view address : {std::string_view(config.listen), text}) {
    const auto listen = parse_host_port(address);
    if (!listen.ok()) continue;
    const auto again = parse_host_port(listen->to_string());
    must(again.ok() && again->host == listen->host && again->port == listen->port);
  }
  return 0;
}
