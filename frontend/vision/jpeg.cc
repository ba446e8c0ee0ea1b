#include "frontend/vision/jpeg.h"

#include <array>
#include <csetjmp>
#include <cstdio>
#include <memory>

// These headers need FILE and size_t to be declared before.
#include <jerror.h>
#include <jpeglib.h>

namespace relmap::vision {

namespace {

struct Errors : jpeg_error_mgr {
  std::jmp_buf escape;
  std::array<char, JMSG_LENGTH_MAX> message;
};

[[noreturn]] void give_up(j_common_ptr info) {
  auto& errors = *static_cast<Errors*>(info->err);
  errors.format_message(info, errors.message.data());
  std::longjmp(errors.escape, 1);
}

// Level -1 marks warnings: damage that libjpeg would decode around.
void on_message(j_common_ptr info, int level) {
  const int code = info->err->msg_code;
  // Many cameras pad the end of their pictures; versions and colours say nothing about grey.
  const bool harmless = code == JWRN_EXTRANEOUS_DATA || code == JWRN_JFIF_MAJOR || code == JWRN_ADOBE_XFORM;
  if (level < 0 && !harmless) give_up(info);
}

// Returns false if errors.message says why not. It owns no object with a destructor, since longjmp would skip it.
bool decode(ByteSpan file, int reduction, jpeg_decompress_struct& info, Errors& errors, Image& grey) {
  if (setjmp(errors.escape) != 0) return false;
  jpeg_create_decompress(&info);
  jpeg_mem_src(&info, file.data(), file.size());
  jpeg_read_header(&info, TRUE);
  info.out_color_space = JCS_GRAYSCALE;
  info.scale_denom = static_cast<unsigned>(reduction);
  jpeg_start_decompress(&info);
  grey = Image(static_cast<int>(info.output_width), static_cast<int>(info.output_height));
  while (info.output_scanline < info.output_height) {
    JSAMPROW row = grey.row(static_cast<int>(info.output_scanline));
    jpeg_read_scanlines(&info, &row, 1);
  }
  jpeg_finish_decompress(&info);
  return true;
}

}  // namespace

Result<Image> decode_jpeg(ByteSpan file, int reduction) {
  Errors errors{};
  jpeg_decompress_struct info{};
  info.err = jpeg_std_error(&errors);
  errors.error_exit = give_up;
  errors.emit_message = on_message;
  const std::unique_ptr<jpeg_decompress_struct, void (*)(jpeg_decompress_struct*)> closing(
      &info, [](jpeg_decompress_struct* opened) { jpeg_destroy_decompress(opened); });
  Image grey;
  if (decode(file, reduction, info, errors, grey)) return grey;
  if (info.jpeg_color_space == JCS_CMYK || info.jpeg_color_space == JCS_YCCK)
    return {Reason::UNSUPPORTED, "JPEG in CMYK: pictures are grey or RGB"};
  return {Reason::PICTURE_DAMAGED, errors.message.data()};
}

}  // namespace relmap::vision
