#include "light/environment_reading.hpp"

#include "base/progress_part.hpp"

namespace cumulet::light {

void convert_rows(EnvironmentPixels& pixels, const glm::dmat3& matrix, const std::string& from, Progress* progress) {
  std::uint64_t outside = 0;
  for (std::uint32_t y = 0; y < pixels.height; ++y) {
    check(progress);
    outside += convert(row_of(pixels, y), matrix);
  }
  std::string remark = "converted from " + from + " to linear Rec. 709";
  if (outside > 0) remark += ", which desaturates " + std::to_string(outside) + " pixels outside its gamut";
  pixels.remarks.push_back(remark);
}

}  // namespace cumulet::light
