// Any text as a list of pictures: what is read has names and rising times, all of it pairs up with itself, and no
// picture is lost where lists are of different moments.
#include "frontend/capture/picture_list.h"
#include "proto/base/testing/fuzzing.h"
#include "storage/testing/temporary_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap;
  using namespace relmap::capture;
  using fuzzing::must;
  static const storage::TemporaryFolder kFolder;
  const std::string file = kFolder / "rgb.txt";
  fuzzing::write_file(file, {data, size});
  for (const auto unit : {TimeUnit::kSeconds, TimeUnit::kNanoseconds}) {
    const auto pictures = parse_picture_list(fuzzing::text_of({data, size}), unit, "folder");
    const auto read = read_picture_list(file, unit, "folder");
    must(read.reason() == pictures.reason() && (read.ok() || read.status().message().starts_with(file)));
    if (!pictures.ok()) continue;
    must(!pictures->empty() && pictures->size() == read->size());
    for (std::size_t i = 0; i < pictures->size(); ++i) {
      must((*pictures)[i].path != "folder");
      must(i == 0 || (*pictures)[i].time_us > (*pictures)[i - 1].time_us);
    }
    const auto timed = pair_by_time(*pictures, *pictures);
    must(timed.pairs.size() == pictures->size() && timed.alone.empty());
    auto others = *pictures;
    for (std::size_t i = 0; i < others.size(); i += 2) others[i].time_us += 2 * kSameMomentUs;
    others.pop_back();
    const auto apart = pair_by_time(*pictures, others);
    must(2 * apart.pairs.size() + apart.alone.size() == pictures->size() + others.size());
    const auto one_eye = one_eyed(*pictures);
    must(one_eye.pairs.size() == pictures->size() && one_eye.pairs.front().right.empty());
  }
  return 0;
}
