#include "frontend/picture_report.h"

#include <iomanip>
#include <utility>

#include "frontend/table_file.h"

namespace relmap::frontend {

Result<PictureReport> PictureReport::open(const std::string& path, bool goes_on) {
  auto out = open_table(path, "picture\tfile\ttime_us\tkeyframe\tfeatures\tdescription_ms", goes_on);
  if (!out.ok()) return out.status();
  return PictureReport(path, std::move(*out));
}

void PictureReport::add(const tracking::MonoPicture& picture) {
  const Keyframe& keyframe = picture.keyframe;
  out_ << picture.index << '\t' << picture.picture << '\t' << keyframe.time_us << '\t' << keyframe.sequence << '\t'
       << keyframe.appearance.size() << '\t' << std::setprecision(3) << picture.description_ms << std::endl;
  ++keyframes_;
  features_ += keyframe.appearance.size();
}

Status PictureReport::close() {
  out_ << "# keyframes\t" << keyframes_ << '\n';
  if (keyframes_ > 0)
    out_ << "# features, mean\t" << static_cast<double>(features_) / static_cast<double>(keyframes_) << '\n';
  out_.close();
  if (!out_) return {Reason::IO_ERROR, path_ + " is not complete"};
  return {};
}

}  // namespace relmap::frontend
