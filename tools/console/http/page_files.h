// The files of the page, which are part of the program.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/console/http/router.h"

namespace relmap::console {

struct PageFile {
  std::string_view name;  // "console.js", "index.html"; "console.js.br": the former as Brotli compresses it
  std::string_view bytes;
};

// What was in page/dist when the program was built; made by the build.
std::span<const PageFile> built_in_page();

// A route for each file, at "/NAME", and "/" for index.html. They need no login. Browsers that take Brotli (over TLS,
// or on their own machine) get the file that is compressed so, if there is one; others get it compressed by gzip, here,
// once. The files must outlive the routes.
void add_page(std::span<const PageFile> files, Router& router);

// By the ending of the name.
std::string_view type_of(std::string_view name);

}  // namespace relmap::console
