#include "core/video/vp8.hpp"

#ifdef CONNECT_VIDEO
#include <vpx/vp8cx.h>
#include <vpx/vp8dx.h>
#include <vpx/vpx_decoder.h>
#include <vpx/vpx_encoder.h>
#endif

namespace connect_bridge::video {

#ifdef CONNECT_VIDEO
bool has_vp8() {
  return true;
}

namespace {

// A faster setting costs too much of the picture, and small ones are fast anyway: 2.9 ms instead
// of 5.9 at 640x480 for an SSIM of 0.858 instead of 0.866.
int speed_of(Size size) {
  return std::uint64_t{size.width} * size.height < 640 * 480 ? -4 : -8;
}

vpx_image_t image_of(const YuvView& picture) {
  vpx_image_t image{};
  // libvpx takes no pointers to constant bytes, and does not write to them.
  const auto writable = [](const std::uint8_t* bytes) { return const_cast<std::uint8_t*>(bytes); };
  vpx_img_wrap(&image, VPX_IMG_FMT_I420, picture.size.width, picture.size.height, 1,
               writable(picture.y));
  image.planes[VPX_PLANE_U] = writable(picture.u);
  image.planes[VPX_PLANE_V] = writable(picture.v);
  image.stride[VPX_PLANE_Y] = static_cast<int>(picture.y_step);
  image.stride[VPX_PLANE_U] = image.stride[VPX_PLANE_V] = static_cast<int>(picture.uv_step);
  return image;
}

}  // namespace

struct Vp8Encoder::Context {
  vpx_codec_ctx_t codec{};
  vpx_codec_enc_cfg_t config{};
  bool works = false;
  vpx_codec_pts_t next = 0;

  explicit Context(Size size) {
    if (vpx_codec_enc_config_default(vpx_codec_vp8_cx(), &config, 0) != VPX_CODEC_OK) return;
    config.g_w = size.width;
    config.g_h = size.height;
    config.g_threads = 1;  // its threads wait by spinning
    config.g_lag_in_frames = 0;
    config.g_error_resilient = 0;
    config.g_timebase = {1, 30};
    config.rc_end_usage = VPX_CBR;
    config.rc_target_bitrate = 100'000;  // the quantiser alone decides
    config.rc_dropframe_thresh = 0;
    config.rc_resize_allowed = 0;
    config.kf_mode = VPX_KF_DISABLED;
    if (vpx_codec_enc_init(&codec, vpx_codec_vp8_cx(), &config, 0) != VPX_CODEC_OK) return;
    works = vpx_codec_control(&codec, VP8E_SET_CPUUSED, speed_of(size)) == VPX_CODEC_OK;
  }
  ~Context() { vpx_codec_destroy(&codec); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  [[nodiscard]] ByteView encode(const YuvView& picture, std::uint8_t quantiser, bool base) {
    if (config.rc_min_quantizer != quantiser || config.rc_max_quantizer != quantiser) {
      config.rc_min_quantizer = config.rc_max_quantizer = quantiser;
      if (vpx_codec_enc_config_set(&codec, &config) != VPX_CODEC_OK) return {};
    }
    const vpx_image_t image = image_of(picture);
    if (vpx_codec_encode(&codec, &image, next++, 1, base ? VPX_EFLAG_FORCE_KF : 0,
                         VPX_DL_REALTIME) != VPX_CODEC_OK)
      return {};
    int made_with = -1;
    if (vpx_codec_control(&codec, VP8E_GET_LAST_QUANTIZER_64, &made_with) != VPX_CODEC_OK ||
        made_with != quantiser)
      return {};
    return only_frame();
  }

 private:
  // Exactly one frame must come out for each that goes in: nothing may wait inside.
  [[nodiscard]] ByteView only_frame() {
    ByteView frame;
    vpx_codec_iter_t iterator = nullptr;
    while (const vpx_codec_cx_pkt_t* packet = vpx_codec_get_cx_data(&codec, &iterator)) {
      if (packet->kind != VPX_CODEC_CX_FRAME_PKT) continue;
      if (!frame.empty()) return {};
      frame = {static_cast<const std::uint8_t*>(packet->data.frame.buf), packet->data.frame.sz};
    }
    return frame;
  }
};

Vp8Encoder::Vp8Encoder(Size size) : context_(std::make_unique<Context>(size)) {}

ByteView Vp8Encoder::encode(const YuvView& picture, std::uint8_t quantiser, bool base) {
  if (!context_->works) return {};
  const ByteView frame = context_->encode(picture, quantiser, base);
  context_->works = !frame.empty();
  return frame;
}

struct Vp8Decoder::Context {
  vpx_codec_ctx_t codec{};
  bool works = false;

  Context() {
    vpx_codec_dec_cfg_t config{};
    config.threads = 1;
    works = vpx_codec_dec_init(&codec, vpx_codec_vp8_dx(), &config, 0) == VPX_CODEC_OK;
  }
  ~Context() { vpx_codec_destroy(&codec); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  [[nodiscard]] const vpx_image_t* decode(ByteView frame) {
    if (vpx_codec_decode(&codec, frame.data(), static_cast<unsigned>(frame.size()), nullptr, 0) !=
        VPX_CODEC_OK)
      return nullptr;
    int corrupted = 1;
    if (vpx_codec_control(&codec, VP8D_GET_FRAME_CORRUPTED, &corrupted) != VPX_CODEC_OK ||
        corrupted != 0)
      return nullptr;
    vpx_codec_iter_t iterator = nullptr;
    return vpx_codec_get_frame(&codec, &iterator);
  }
};

Vp8Decoder::Vp8Decoder() : context_(std::make_unique<Context>()) {}

std::optional<YuvView> Vp8Decoder::decode(ByteView frame) {
  const vpx_image_t* const image = context_->works ? context_->decode(frame) : nullptr;
  if (image == nullptr || image->fmt != VPX_IMG_FMT_I420) return std::nullopt;
  return YuvView{{image->d_w, image->d_h},
                 image->planes[VPX_PLANE_Y],
                 image->planes[VPX_PLANE_U],
                 image->planes[VPX_PLANE_V],
                 static_cast<std::size_t>(image->stride[VPX_PLANE_Y]),
                 static_cast<std::size_t>(image->stride[VPX_PLANE_U])};
}

#else

bool has_vp8() {
  return false;
}
struct Vp8Encoder::Context {};
struct Vp8Decoder::Context {};
Vp8Encoder::Vp8Encoder(Size) {}
ByteView Vp8Encoder::encode(const YuvView&, std::uint8_t, bool) {
  return {};
}
Vp8Decoder::Vp8Decoder() = default;
std::optional<YuvView> Vp8Decoder::decode(ByteView) {
  return std::nullopt;
}

#endif

Vp8Encoder::~Vp8Encoder() = default;
Vp8Encoder::Vp8Encoder(Vp8Encoder&&) noexcept = default;
Vp8Encoder& Vp8Encoder::operator=(Vp8Encoder&&) noexcept = default;
Vp8Decoder::~Vp8Decoder() = default;
Vp8Decoder::Vp8Decoder(Vp8Decoder&&) noexcept = default;
Vp8Decoder& Vp8Decoder::operator=(Vp8Decoder&&) noexcept = default;

}  // namespace connect_bridge::video
