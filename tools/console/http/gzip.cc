#include "tools/console/http/gzip.h"

#include <zlib.h>

#include <algorithm>
#include <cctype>

namespace relmap::console {

namespace {

constexpr std::size_t kWorthIt = 1024;  // less fits into one packet anyway
constexpr int kGzipWindow = 15 + 16;    // the largest window, with gzip's header
constexpr int kUsualMemory = 8;

}  // namespace

std::optional<std::string> gzip(std::string_view bytes, Effort effort) {
  if (bytes.size() < kWorthIt) return {};
  z_stream stream{};
  if (deflateInit2(&stream, static_cast<int>(effort), Z_DEFLATED, kGzipWindow, kUsualMemory, Z_DEFAULT_STRATEGY) !=
      Z_OK)
    return {};
  std::string out(bytes.size() - bytes.size() / 10, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const int end = deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  if (end != Z_STREAM_END) return {};
  return out;
}

bool accepts(std::string_view header, std::string_view encoding) {
  const std::string weighed = std::string(encoding) + ";q=";
  while (!header.empty()) {
    const std::size_t end = std::min(header.find(','), header.size());
    std::string one;
    for (const char c : header.substr(0, end))
      if (c != ' ') one += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    header.remove_prefix(std::min(end + 1, header.size()));
    if (one == encoding) return true;
    if (one.starts_with(weighed) && one.find_first_of("123456789", weighed.size()) != std::string::npos) return true;
  }
  return false;
}

bool may_compress(std::string_view type) {
  return type.starts_with("text/") || type.starts_with("application/json") ||
         type.starts_with("application/octet-stream") || type.starts_with("application/vnd.relmap.") ||
         type == "image/svg+xml";
}

}  // namespace relmap::console
