// The C++ side of localise_cost.py: localises by what a frame saw, as often as each line of standard input says, and
// prints the seconds that it took.
#include <chrono>
#include <cstdio>
#include <iostream>

#include "client/relmap_client.h"

int main(int argc, char** argv) {
  using relmap::FrameId;
  const auto frame = argc == 3 ? FrameId::parse(argv[2]) : std::nullopt;
  if (!frame) {
    std::fprintf(stderr, "usage: relmap_localise_loop SERVER FRAME\n");
    return 2;
  }
  auto client = relmap::client::Client::connect(argv[1]);
  if (!client.ok()) {
    std::fprintf(stderr, "%s\n", client.status().to_string().c_str());
    return 1;
  }
  relmap::client::View view;
  view.frame = *frame;
  for (int calls = 0; std::cin >> calls;) {
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < calls; ++i) {
      if (const auto place = (*client)->localise(view); !place.ok()) {
        std::fprintf(stderr, "%s\n", place.status().to_string().c_str());
        return 1;
      }
    }
    std::printf("%.9f\n", std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    std::fflush(stdout);
  }
}
