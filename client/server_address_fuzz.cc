// Any text as an address that a user gives, and as the file by which a daemon says where it answers.
#include <filesystem>
#include <string>

#include "client/server_address.h"
#include "proto/base/testing/fuzzing.h"
#include "storage/testing/temporary_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap;
  using fuzzing::must;
  static const storage::TemporaryFolder kFolder;
  const std::string text(fuzzing::text_of({data, size}));
  // Beside the data folder, so that no text is the name of a folder of this machine.
  const std::string given = "nowhere/" + text;
  const auto by_name = client::resolve_server(given);
  must(by_name.ok() ? by_name->address == given : by_name.reason() == Reason::INVALID_ARGUMENT);
  if (text.starts_with("unix:/")) must(client::resolve_server(text).ok());

  fuzzing::write_file(kFolder / "endpoint", {data, size});
  const auto served = client::resolve_server(kFolder / "");
  must(served.ok() || served.reason() == Reason::CORRUPT);
  if (served.ok()) must(!served->address.empty() && !served->boot_id.empty());
  if (served.ok() && served->is_socket()) must(served->address.find_first_of("?#") == std::string::npos);
  std::filesystem::remove(kFolder / "endpoint");
  must(client::resolve_server(kFolder / "").reason() == Reason::UNREACHABLE);
  return 0;
}
