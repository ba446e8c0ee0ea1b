// Where was this pair of pictures taken?   where_am_i SERVER LEFT RIGHT
#include <relmap/client/relmap_client.h>

#include <fstream>
#include <iostream>
#include <iterator>

std::string contents(const char* file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

int main(int argc, char** argv) try {
  if (argc != 4) return 2;
  const auto client = relmap::client::Client::connect(argv[1]).or_throw();
  relmap::client::View view{.left = contents(argv[2]), .right = contents(argv[3])};
  view.camera = client->sessions().or_throw().at(0).camera;  // of the first session: rectified pictures
  const auto found = client->localise(view).or_throw();
  std::cout << "in frame " << found.frame.to_string() << " at " << found.T_frame_view.t.transpose() << " m, "
            << found.inliers << " inliers\n";
} catch (const std::exception& error) {  // of or_throw(): the reason and what to do
  std::cerr << error.what() << '\n';
  return 1;
}
