#include "denoise/network.hpp"

#include "base/error.hpp"

namespace cumulet::denoise {

namespace {

constexpr std::uint32_t max_channels = 512;
constexpr std::uint32_t colors = 3;

/// The convolutions without shapes, weights and biases. Numbers are indices into the list.
std::array<Convolution, Network::convolution_count> topology() {
  const Source input{};
  const auto of = [](std::size_t convolution) { return Source{convolution, false}; };
  const auto enlarged = [](std::size_t convolution) { return Source{convolution, true}; };
  const auto layer = [](std::string_view name, std::vector<Source> sources, bool pooled, unsigned level) {
    return Convolution{name, std::move(sources), pooled, 0, 0, level, {}, {}};
  };
  return {{layer("enc_conv0", {input}, false, 0),                 // 0
           layer("enc_conv1", {of(0)}, true, 0),                  // 1
           layer("enc_conv2", {of(1)}, true, 1),                  // 2
           layer("enc_conv3", {of(2)}, true, 2),                  // 3
           layer("enc_conv4", {of(3)}, true, 3),                  // 4
           layer("enc_conv5a", {of(4)}, false, 4),                // 5
           layer("enc_conv5b", {of(5)}, false, 4),                // 6
           layer("dec_conv4a", {enlarged(6), of(3)}, false, 3),   // 7
           layer("dec_conv4b", {of(7)}, false, 3),                // 8
           layer("dec_conv3a", {enlarged(8), of(2)}, false, 2),   // 9
           layer("dec_conv3b", {of(9)}, false, 2),                // 10
           layer("dec_conv2a", {enlarged(10), of(1)}, false, 1),  // 11
           layer("dec_conv2b", {of(11)}, false, 1),               // 12
           layer("dec_conv1a", {enlarged(12), input}, false, 0),  // 13
           layer("dec_conv1b", {of(13)}, false, 0),               // 14
           layer("dec_conv0", {of(14)}, false, 0)}};              // 15
}

std::string text(const std::vector<std::uint32_t>& shape) {
  std::string result;
  for (const std::uint32_t extent : shape) {
    if (!result.empty()) result += 'x';
    result += std::to_string(extent);
  }
  return result;
}

class Maker {
 public:
  Maker(const TensorArchive& archive, const std::string& name) : archive_(archive), name_(name) {}

  NetworkPtr make() {
    auto network = std::make_shared<Network>();
    network->convolutions = topology();
    const Tensor& first = tensor("enc_conv0.weight", "oihw");
    network->inputs = first.shape.at(1);
    if (network->inputs != colors && network->inputs != 3 * colors) {
      fail("enc_conv0.weight", first, "with 3 or 9 inputs");
    }
    for (Convolution& convolution : network->convolutions) {
      for (const Source& source : convolution.sources) {
        convolution.inputs +=
            source.convolution ? network->convolutions.at(*source.convolution).outputs : network->inputs;
      }
      fill(convolution);
    }
    const Convolution& last = network->convolutions.back();
    if (last.outputs != colors) fail("dec_conv0.weight", tensor("dec_conv0.weight", "oihw"), "with 3 outputs");
    return network;
  }

 private:
  [[noreturn]] void fail(const std::string& tensor_name, const Tensor& tensor, const std::string& expected) const {
    throw Error(ErrorCode::file,
                name_ + ": tensor '" + tensor_name + "' is " + text(tensor.shape) + ", not " + expected);
  }

  [[nodiscard]] const Tensor& tensor(const std::string& tensor_name, const std::string& layout) const {
    const auto found = archive_.find(tensor_name);
    if (found == archive_.end()) throw Error(ErrorCode::file, name_ + ": has no tensor '" + tensor_name + "'");
    if (found->second.layout != layout) {
      throw Error(ErrorCode::file, name_ + ": tensor '" + tensor_name + "' is not laid out as " + layout);
    }
    return found->second;
  }

  void fill(Convolution& convolution) const {
    const std::string name(convolution.name);
    const Tensor& weights = tensor(name + ".weight", "oihw");
    convolution.outputs = weights.shape.at(0);
    if (convolution.outputs > max_channels) fail(name + ".weight", weights, "with at most 512 outputs");
    const std::vector<std::uint32_t> shape{convolution.outputs, convolution.inputs, 3, 3};
    if (weights.shape != shape) fail(name + ".weight", weights, text(shape));
    const Tensor& biases = tensor(name + ".bias", "x");
    if (biases.shape != std::vector{convolution.outputs}) {
      fail(name + ".bias", biases, std::to_string(convolution.outputs));
    }
    convolution.weights = weights.values;
    convolution.biases = biases.values;
  }

  const TensorArchive& archive_;
  const std::string& name_;
};

}  // namespace

double Network::multiply_adds() const {
  double sum = 0.0;
  for (const Convolution& convolution : convolutions) {
    sum += static_cast<double>(convolution.weights.size()) / static_cast<double>(1U << (2 * convolution.level));
  }
  return sum;
}

NetworkPtr make_network(const TensorArchive& archive, const std::string& name) { return Maker(archive, name).make(); }

}  // namespace cumulet::denoise
