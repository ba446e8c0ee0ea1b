// Any bytes as a photograph: its size and what EXIF says of its lens are read, or a named reason; a folder of such
// files is divided by camera without loss.
#include <filesystem>
#include <string>
#include <vector>

#include "frontend/capture/picture_camera.h"
#include "proto/base/testing/fuzzing.h"
#include "storage/testing/temporary_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap;
  using namespace relmap::capture;
  using fuzzing::must;
  static const storage::TemporaryFolder kFolder;
  const std::filesystem::path picture = kFolder / "a.jpg", other = kFolder / "b.jpg", none = kFolder / "none.jpg";
  fuzzing::write_file(picture, {data, size});
  fuzzing::write_file(other, ByteSpan(data, size).first(size - size / 4));
  const auto camera = read_picture_camera(picture);
  if (camera.ok()) {
    must(camera->width > 0 && camera->height > 0 && camera->focal_35mm >= 0);
    must(!camera->name().empty() && (camera->focal_length() > 0) == (camera->focal_35mm > 0));
  } else {
    must(fuzzing::is_one_of(camera.reason(),
                            {Reason::NOT_A_PICTURE, Reason::PICTURE_DAMAGED, Reason::PICTURE_TOO_LARGE}));
  }
  must(read_picture_camera(none).reason() == Reason::NO_SUCH_FILE);
  const std::vector<std::filesystem::path> pictures{picture, other, picture, none};
  const auto cameras = by_camera(pictures);
  std::size_t found = 0;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    must(i == 0 || cameras[i].pictures.size() <= cameras[i - 1].pictures.size());
    found += cameras[i].pictures.size();
  }
  must(!cameras.empty() && found == pictures.size());
  return 0;
}
