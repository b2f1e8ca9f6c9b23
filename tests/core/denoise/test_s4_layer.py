from __future__ import annotations

import copy
import pickle
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from sd2core.denoise.causal_models import S4Denoiser
from sd2core.denoise.s4_functions import convolution
from sd2core.denoise.s4_kernel import legs_kernel
from sd2core.denoise.s4_layer import S4Layer
from sd2core.denoise.s4_space import SLOWEST_DECAY, Kernel, StateSpace, joint_kernels
from sd2core.errors import Sd2Error

KERNELS = ("legs", "diagonal")


@pytest.fixture(autouse=True)
def seeded() -> Iterator[None]:
    with torch.random.fork_rng():
        torch.manual_seed(20)
        yield


def layer_of(kernel: str, channels: int = 6, state_size: int = 16, **options: Any) -> S4Layer:
    return S4Layer(channels, state_size, kernel, **options).eval()  # type: ignore[arg-type]


def largest(values: Tensor) -> float:
    return float(values.detach().abs().max())


@pytest.mark.parametrize("kernel", KERNELS)
def test_no_frame_knows_of_later_ones(kernel: str) -> None:
    layer = layer_of(kernel)
    for batch, length in ((2, 40), (20, 40)):  # by transform and by product
        x = torch.randn(batch, length, 6)
        other = x.clone()
        other[:, 25:] += torch.randn(batch, length - 25, 6)
        apart = (layer(x) - layer(other)).abs().amax((0, 2)).detach()
        assert float(apart[:25].max()) < 2e-6
        assert float(apart[25:].min()) > 1e-2


@pytest.mark.parametrize("kernel", KERNELS)
def test_frame_by_frame_is_the_convolution(kernel: str) -> None:
    space = layer_of(kernel, 5, 64).past
    with torch.no_grad():
        space.log_dt.copy_(torch.tensor([1e-4, 1e-3, 1e-2, 0.1, 1.0]).log())
        signal = torch.randn(5, 1, 2304)
        at_once = convolution(signal, space.kernel(2304))
        recurrence, frames = space.recurrence(), []
        state = recurrence.initial_state(1)
        for frame in signal.double().unbind(-1):
            out, state = recurrence.step(frame, state)
            frames.append(out)
    one_by_one = torch.stack(frames, -1)
    for channel in range(5):
        limit = 2e-5 * largest(at_once[channel])
        assert largest(one_by_one[channel] - at_once[channel]) <= limit


@pytest.mark.parametrize("kernel", KERNELS)
def test_chunks_are_the_whole(kernel: str) -> None:
    layer = layer_of(kernel)
    x = torch.randn(3, 340, 6)
    with torch.no_grad():
        state, parts = layer.initial_state(3), []
        for chunk in x.split([1, 63, 64, 0, 140, 72], 1):
            part, state = layer.chunk(chunk, state)
            parts.append(part)
        whole = layer(x)
        state, frames = layer.initial_state(3), []
        for t in range(x.shape[1]):
            frame, state = layer.chunk(x[:, t, None], state)
            frames.append(frame)
    assert largest(torch.cat(parts, 1) - whole) < 5e-6
    assert largest(torch.cat(frames, 1) - whole) < 5e-6


def test_two_directions_see_both_and_cannot_run_live() -> None:
    layer = layer_of("legs", bidirectional=True)
    x = torch.randn(1, 30, 6)
    other = x.clone()
    other[:, 20] += torch.randn(6)
    apart = (layer(x) - layer(other)).abs().amax((0, 2)).detach()
    assert float(apart.min()) > 1e-4
    with pytest.raises(Sd2Error, match="looks ahead"):
        layer.initial_state(1)


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_longer_input_changes_nothing(kernel: str) -> None:
    layer = layer_of(kernel)
    before = copy.deepcopy(layer.state_dict())
    x = torch.randn(1, 30, 6)
    with torch.no_grad():
        first = layer(x)
        longer = layer(torch.cat((x, torch.randn(1, 300, 6)), 1))
        again = layer(x)
    assert torch.equal(first, again)
    assert largest(longer[:, :30] - first) < 2e-6
    for name, value in layer.state_dict().items():
        assert torch.equal(value, before[name])


def test_starts_as_hippo_legs() -> None:
    layer = layer_of("legs", 5, 64)
    with torch.no_grad():
        made = layer.past.kernel(72)
        made[:, 0] -= layer.past.skip
        true = legs_kernel(layer.past.outputs, layer.past.dt(), 72)
    assert largest(made - true) < 1e-5 * largest(true)


def shaken(layer: S4Layer, size: float) -> S4Layer:
    with torch.no_grad():
        for parameter in layer.past.parameters():
            parameter += size * torch.randn_like(parameter)
    return layer


@pytest.mark.parametrize(("dt_min", "dt_max"), [(1e-3, 1e-1), (0.2, 2.0), (0.5, 0.5)])
def test_steps_start_where_they_are_told(dt_min: float, dt_max: float) -> None:
    steps = StateSpace(400, 4, "legs", dt_min, dt_max).dt().detach()
    assert dt_min * (1 - 1e-6) <= float(steps.min()) <= float(steps.max()) <= dt_max * (1 + 1e-6)
    middle = float(steps.log().mean()) - np.log(dt_min) / 2 - np.log(dt_max) / 2
    assert abs(middle) <= 0.06 * np.log(dt_max / dt_min) + 1e-6


@pytest.mark.parametrize("kernel", KERNELS)
def test_the_smaller_the_step_the_farther_a_channel_looks_back(kernel: Kernel) -> None:
    space = StateSpace(200, 16, kernel, 1e-2, 1e-1).eval()
    with torch.no_grad():
        steps, response = space.dt(), space.kernel(4096)[:, 1:].double() ** 2
    looks_back = (response * torch.arange(1, 4096)).sum(1) / response.sum(1)
    assert float(torch.corrcoef(torch.stack((looks_back.log(), -steps.log())))[0, 1]) > 0.8


@pytest.mark.parametrize("size", [0.1, 1.0, 10.0, 100.0])
def test_no_noise_on_the_parameters_makes_it_unstable(size: float) -> None:
    layer = shaken(layer_of("legs", 50), size)
    matrix = layer.past.matrix()
    poles, p = (values.detach().numpy() for values in (matrix.poles, matrix.low_rank))
    for channel in range(50):
        full = np.concatenate((poles[channel], poles[channel].conj()))
        both = np.concatenate((p[channel], p[channel]))
        # Its Hermitian part is below −SLOWEST_DECAY; eigenvalues lie in its numerical range.
        A = np.diag(full) - np.outer(both, both)
        rounding = 1e-14 * np.abs(A).max()
        assert np.linalg.eigvals(A).real.max() <= -SLOWEST_DECAY + rounding
    assert layer_of("diagonal").past.poles().real.max() < 0
    assert shaken(layer_of("diagonal"), size).past.poles().real.max() <= -SLOWEST_DECAY


@pytest.mark.one_in(5)
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("log_dt", [-200.0, 0.0, 200.0])
@pytest.mark.parametrize("log_decay", [-200.0, 0.0, 200.0])
def test_no_logarithm_is_too_large(kernel: str, log_dt: float, log_decay: float) -> None:
    for length in (1, 72):
        layer = layer_of(kernel, 3)
        with torch.no_grad():
            layer.past.log_dt.fill_(log_dt)
            layer.past.log_decay.fill_(log_decay)
        x = torch.randn(17, length, 3)
        out = layer(x)
        out.square().sum().backward()
        assert out.isfinite().all()
        for parameter in layer.parameters():
            assert parameter.grad is not None
            assert parameter.grad.isfinite().all()
        with torch.no_grad():
            frame, state = layer.chunk(x[:, :1], layer.initial_state(17))
        assert largest(frame - out[:, :1]) <= 1e-5 * largest(out[:, 0])
        assert state.isfinite().all()


@pytest.mark.slow
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("bidirectional", [False, True])
def test_derivatives_of_the_layer(kernel: str, bidirectional: bool) -> None:
    layer = layer_of(kernel, 2, 4, bidirectional=bidirectional).double()
    names = [name for name, _ in layer.named_parameters()]
    values = [parameter.detach().requires_grad_() for parameter in layer.parameters()]
    x = torch.randn(2, 5, 2, dtype=torch.float64, requires_grad=True)

    def made(x: Tensor, *values: Tensor) -> Tensor:
        return torch.func.functional_call(layer, dict(zip(names, values, strict=True)), (x,))

    assert torch.autograd.gradcheck(made, (x, *values))


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("length", [1, 40, 500])
def test_kernels_worked_out_together_are_those_of_each(kernel: Kernel, length: int) -> None:
    spaces = [StateSpace(3, 16, kernel) for _ in range(4)]
    gradients = torch.randn(4, 3, length)
    apart = [space.kernel(length) for space in spaces]
    with torch.autocast("cpu", dtype=torch.bfloat16):
        together = joint_kernels(spaces, length)
    for true, found, gradient, space in zip(apart, together, gradients, spaces, strict=True):
        assert largest(found - true) <= 1e-6 * largest(true)
        wanted = torch.autograd.grad(true, list(space.parameters()), gradient)
        given = torch.autograd.grad(found, list(space.parameters()), gradient, retain_graph=True)
        for one, other in zip(given, wanted, strict=True):
            assert largest(one - other) <= 1e-6 * largest(other)


@pytest.mark.parametrize("bidirectional", [False, True])
def test_a_stack_is_its_layers_one_after_another(bidirectional: bool) -> None:
    stack = S4Denoiser(3, channels=6, depth=3, state_size=8, bidirectional=bidirectional)
    x = torch.randn(17, 30, 3)
    hidden = stack.lift(x)
    for layer in stack.layers:
        hidden = layer(hidden)
    true = stack.head(hidden)
    assert largest(stack(x) - true) <= 1e-6 * largest(true)
    with torch.no_grad():
        assert largest(stack.eval()(x) - true) <= 1e-6 * largest(true)


def test_mixed_precision_leaves_the_layer_in_single() -> None:
    layer, x = layer_of("legs"), torch.randn(20, 30, 6)
    true = layer(x)
    with torch.autocast("cpu", dtype=torch.bfloat16):
        assert torch.equal(layer(x), true)
        assert layer(x.bfloat16()).dtype == torch.float32


def test_all_but_outputs_and_skip_are_dynamics() -> None:
    layer = layer_of("legs", bidirectional=True)
    given = {id(parameter) for parameter in layer.ssm_parameters()}
    rest = {name for name, parameter in layer.named_parameters() if id(parameter) not in given}
    assert rest == {
        *("mixing.weight", "mixing.bias"),
        *(f"{part}.{name}" for part in ("past", "future") for name in ("outputs", "skip")),
    }


def test_dropout_leaves_out_whole_channels_while_learning_only() -> None:
    layer = layer_of("legs", dropout=0.5)
    x = torch.randn(4, 20, 6)
    with torch.no_grad():
        whole = layer(x)
        assert torch.equal(layer(x), whole)
        layer.train()
        first, second = layer(x), layer(x)
        assert largest(first - second) > 1e-2
        layer.mixing.weight.zero_()
        layer.mixing.weight[0, 0] = 1.0  # a = what channel 0 lets through, the gate is half open
        layer.mixing.bias.zero_()
        through = 2 * (layer(x) - x)[..., 0]
        layer.eval()
        kept = 2 * (layer(x) - x)[..., 0]
    ratio = through / kept
    for row in ratio:
        assert largest(row - row[0]) < 1e-3
        assert round(float(row[0]), 2) in (0.0, 2.0)


class TestKept:
    """What follows from the parameters is kept while nothing is learned, and no longer."""

    @pytest.fixture
    def made(self, monkeypatch: pytest.MonkeyPatch) -> list[int]:
        lengths: list[int] = []
        true = StateSpace.forward

        def counted(self: StateSpace, length: int) -> Tensor:
            lengths.append(length)
            return true(self, length)

        monkeypatch.setattr(StateSpace, "forward", counted)
        return lengths

    def test_made_once(self, made: list[int]) -> None:
        layer, x = layer_of("legs"), torch.randn(1, 20, 6)
        with torch.no_grad():
            first = layer(x)
            assert torch.equal(layer(x), first)
        assert made == [20]
        with torch.inference_mode():
            layer(x)
        assert made == [20]
        layer(x).sum().backward()  # where derivatives are wanted a kept kernel has none
        assert layer.past.outputs.grad is not None

    @pytest.mark.parametrize("kernel", KERNELS)
    def test_dropped_when_parameters_change(self, kernel: str) -> None:
        layer, other = layer_of(kernel), shaken(layer_of(kernel), 0.3)
        x = torch.randn(1, 40, 6)

        def as_if_new() -> None:
            fresh = layer_of(kernel).to(x.dtype)
            fresh.load_state_dict(layer.state_dict())
            with torch.no_grad():
                assert torch.equal(layer(x), fresh(x))
                frame = layer.chunk(x[:, :1], layer.initial_state(1))[0]
                assert torch.equal(frame, fresh.chunk(x[:, :1], fresh.initial_state(1))[0])
                chunk = layer.chunk(x, layer.initial_state(1))[0]
                assert torch.equal(chunk, fresh.chunk(x, fresh.initial_state(1))[0])

        as_if_new()
        layer.load_state_dict(other.state_dict())
        as_if_new()
        shaken(layer, 0.1)
        as_if_new()
        layer.train()
        optimiser = torch.optim.SGD(layer.parameters(), 0.1)
        layer(x).square().mean().backward()
        optimiser.step()
        layer.eval()
        as_if_new()
        layer.train()
        layer.past.outputs.data += 1.0  # behind autograd's back
        layer.eval()
        as_if_new()
        for _ in range(2):  # the second has been written to as often as the first: never
            layer.past.log_dt = torch.nn.Parameter(layer.past.log_dt.detach() - 1.0)
            as_if_new()
        x = x.double()
        layer.double()
        as_if_new()

    def test_copies_keep_nothing(self) -> None:
        layer, x = layer_of("legs"), torch.randn(1, 20, 6)
        unused = len(pickle.dumps(layer))
        with torch.no_grad():
            true = layer(x)
            assert len(pickle.dumps(layer)) == unused
            copied = copy.deepcopy(layer)
            assert torch.equal(copied(x), true)


@pytest.mark.parametrize("precision", [torch.float16, torch.bfloat16])
@pytest.mark.parametrize("kernel", ["legs", "diagonal"])
def test_half_precision_is_refused_and_autocast_is_the_way(
    kernel: Kernel, precision: torch.dtype
) -> None:
    layer, signal = S4Layer(2, state_size=8, kernel=kernel).eval(), torch.randn(1, 40, 2)
    with torch.autocast("cpu", dtype=torch.bfloat16):
        assert layer(signal).isfinite().all()
    layer.to(precision)
    for run in (
        lambda: layer(signal.to(precision)),
        lambda: layer.initial_state(1),
        lambda: layer.chunk(signal.to(precision), torch.zeros(2, 1, 8, dtype=torch.float64)),
    ):
        with pytest.raises(Sd2Error, match=r"float32 or float64.*autocast"):
            run()
