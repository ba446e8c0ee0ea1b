#include "tools/console/http/page_files.h"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "proto/base/bytes.h"
#include "proto/base/crc32c.h"
#include "proto/base/hex.h"
#include "tools/console/http/gzip.h"

namespace relmap::console {

namespace {

constexpr std::string_view kBrotli = ".br";

std::uint32_t crc_of(std::string_view text) {
  return crc32c(ByteSpan(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

struct Prepared {
  Response plain, by_gzip, by_brotli;  // the latter two with an empty body where there is none, or it does not pay
};

// Not a lambda: closures of coroutines must outlive them, and a copy in the router does.
struct ServeFile {
  std::shared_ptr<const Prepared> file;
  Awaitable<Response> operator()(const Request& request) const {
    const std::string_view accepted = request.header("accept-encoding");
    if (!file->by_brotli.body.empty() && accepts(accepted, "br")) co_return file->by_brotli;
    co_return !file->by_gzip.body.empty() && accepts(accepted, "gzip") ? file->by_gzip : file->plain;
  }
};

}  // namespace

std::string_view type_of(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 10> kTypes{{
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".svg", "image/svg+xml"},
      {".json", "application/json"},
      {".png", "image/png"},
      {".ico", "image/x-icon"},
      {".woff2", "font/woff2"},
      {".wasm", "application/wasm"},
      {".txt", "text/plain; charset=utf-8"},
  }};
  for (const auto& [ending, type] : kTypes)
    if (name.ends_with(ending)) return type;
  return "application/octet-stream";
}

void add_page(std::span<const PageFile> files, Router& router) {
  for (const PageFile& file : files) {
    if (file.name.ends_with(kBrotli)) continue;
    auto prepared = std::make_shared<Prepared>();
    Response& plain = prepared->plain;
    plain.type = type_of(file.name);
    plain.body = file.bytes;
    plain.cache = "no-cache";  // asked for again each time, and answered by 304
    const std::string mark = hex(crc_of(file.bytes)) + "-" + std::to_string(file.bytes.size());
    plain.etag = "\"" + mark + "\"";
    if (auto packed = may_compress(plain.type) ? gzip(file.bytes, Effort::kBest) : std::nullopt) {
      prepared->by_gzip = plain;
      prepared->by_gzip.body = std::move(*packed);
      prepared->by_gzip.encoding = "gzip";
      prepared->by_gzip.etag = "\"" + mark + "-gzip\"";
    }
    const auto brotli = std::find_if(files.begin(), files.end(), [&](const PageFile& other) {
      return other.name.ends_with(kBrotli) && other.name.substr(0, other.name.size() - kBrotli.size()) == file.name;
    });
    if (brotli != files.end()) {
      prepared->by_brotli = plain;
      prepared->by_brotli.body = brotli->bytes;
      prepared->by_brotli.encoding = "br";
      prepared->by_brotli.etag = "\"" + mark + "-br\"";
    }
    const ServeFile serve{std::move(prepared)};
    Route route{"GET", "/" + std::string(file.name), Access::kAnyone, serve};
    route.linked = file.name.ends_with(".html");
    router.add(route);
    if (file.name != "index.html") continue;
    route.pattern = "/";
    router.add(std::move(route));
  }
}

}  // namespace relmap::console
