#include "tools/relmap/picture_output.h"

#include <ostream>

#include "tools/relmap/output_files.h"

namespace relmap::cli {

Status write_output(const std::string& path, const std::string& bytes, terminal::Console& console) {
  OutputFiles files(path, console.out());
  const auto out = files.begin("");
  if (!out.ok()) return out.status();
  **out << bytes;
  return files.finish();
}

}  // namespace relmap::cli
