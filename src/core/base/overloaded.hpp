// std::visit with one lambda per alternative.
#pragma once

namespace connect_bridge {

template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};
template <class... Fs>
Overloaded(Fs...) -> Overloaded<Fs...>;

}  // namespace connect_bridge
