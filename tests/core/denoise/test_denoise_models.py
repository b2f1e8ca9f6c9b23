"""Every model: shapes, causality, streaming, comparable sizes."""

from __future__ import annotations

import pytest
import torch
from denoisers import CAUSAL, SMALL, WINDOWED, trained
from hypothesis import given
from hypothesis import strategies as st

from sd2core.denoise.model import Denoiser, parameter_count
from sd2core.denoise.registry import FILTERS, MODELS, build, summary
from sd2core.denoise.window_models import WINDOW, WindowBlock
from sd2core.errors import Sd2Error

TRAINED = [name for name in SMALL if name not in FILTERS]


def network(name: str, bins: int = 32) -> Denoiser:
    return trained(name, bins=bins).network


@pytest.fixture(autouse=True)
def no_gradients() -> None:
    torch.manual_seed(1)


@pytest.mark.parametrize("name", TRAINED)
def test_all_parameters_learn(name: str) -> None:
    model = trained(name).network.train()
    loss = (model(torch.rand(2, 72, 32)) - torch.rand(2, 72, 32)).square().mean()
    loss.backward()
    for label, parameter in model.named_parameters():
        assert parameter.grad is not None, label
        assert parameter.grad.abs().sum() > 0, label


@pytest.mark.parametrize("name", CAUSAL)
def test_causal_models_do_not_know_the_future(name: str) -> None:
    model = network(name)
    values = torch.rand(1, 60, 32)
    other = values.clone()
    other[:, 40:] = torch.rand(1, 20, 32)
    with torch.no_grad():
        before, after = model(values), model(other)
    torch.testing.assert_close(before[:, :40], after[:, :40], rtol=1e-5, atol=1e-5)
    assert not torch.allclose(before[:, 40:], after[:, 40:])


@pytest.mark.parametrize("name", WINDOWED)
def test_windowed_models_look_both_ways_and_far(name: str) -> None:
    model = trained(name, seed=1).network
    values = torch.rand(1, 72, 32)
    other = values.clone()
    other[:, 40, 20] += 1.0
    with torch.no_grad():
        moved = (model(values) - model(other)).abs().amax((0, 2))
    assert (moved > 1e-6).sum() > 20
    assert (moved[:40] > 1e-6).any()
    assert (moved[41:] > 1e-6).any()


@given(st.sampled_from(CAUSAL), st.lists(st.integers(1, 20), min_size=1, max_size=6))
def test_chunks_and_steps_equal_the_whole(name: str, lengths: list[int]) -> None:
    model = network(name)
    values = torch.rand(2, sum(lengths), 32)
    with torch.no_grad():
        whole = model(values)
        state, pieces = model.initial_state(2), []
        for chunk in values.split(lengths, 1):
            answer, state = model.chunk(chunk, state)
            pieces.append(answer)
        torch.testing.assert_close(torch.cat(pieces, 1), whole, rtol=1e-5, atol=1e-5)
        state = model.initial_state(2)
        for frame in range(min(9, values.shape[1])):
            answer, state = model.chunk(values[:, frame, None], state)
            torch.testing.assert_close(answer[:, 0], whole[:, frame], rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("name", WINDOWED)
def test_windowed_models_have_no_state(name: str) -> None:
    model = network(name)
    assert model.window == 72
    with pytest.raises(NotImplementedError, match="looks at later frames"):
        model.initial_state()


@pytest.mark.one_in(5)
@pytest.mark.parametrize("name", SMALL)
@pytest.mark.parametrize(("frames", "bins"), [(72, 20), (7, 32), (1, 5)])
def test_any_length_and_any_number_of_bins(name: str, frames: int, bins: int) -> None:
    values = torch.rand(2, frames, bins)
    assert network(name, bins)(values).shape == values.shape


@pytest.mark.parametrize("name", SMALL)
def test_takes_of_a_batch_do_not_touch_each_other(name: str) -> None:
    model = network(name)
    values = torch.rand(3, 72, 32)
    with torch.no_grad():
        torch.testing.assert_close(model(values)[1:2], model(values[1:2]), rtol=1e-3, atol=1e-4)


class TestSwinWindows:
    def block(self, shifted: bool) -> WindowBlock:
        block = WindowBlock(16, shifted, 0.0).eval()
        with torch.no_grad():
            for parameter in block.parameters():
                parameter += 0.3 * torch.randn_like(parameter)
        return block

    def reach(self, shifted: bool, row: int, column: int) -> torch.Tensor:
        """Rows and columns of tokens that one token touches, (n, 2)."""
        block = self.block(shifted)
        tall, wide = WINDOW
        tokens = torch.randn(1, 3 * tall, 2 * wide, 16)
        other = tokens.clone()
        other[0, row, column] = torch.randn(16)
        with torch.no_grad():
            return ((block(tokens) - block(other)).abs().amax(-1)[0] > 1e-6).nonzero()

    @staticmethod
    def rectangle(rows: range, columns: range) -> list[list[int]]:
        return [[row, column] for row in rows for column in columns]

    def test_a_token_reaches_its_window_and_no_more(self) -> None:
        tall, wide = WINDOW
        reached = self.reach(False, tall + 1, 1)
        assert reached.tolist() == self.rectangle(range(tall, 2 * tall), range(wide))

    def test_shifted_windows_straddle(self) -> None:
        tall, wide = WINDOW
        reached = self.reach(True, tall, wide)
        rows = range(tall // 2, tall + tall // 2)
        assert reached.tolist() == self.rectangle(rows, range(wide // 2, wide + wide // 2))

    def test_the_shift_does_not_join_opposite_ends(self) -> None:
        tall, wide = WINDOW
        reached = self.reach(True, 0, 0)
        assert reached.tolist() == self.rectangle(range(tall // 2), range(wide // 2))

    def test_attention_by_hand(self) -> None:
        # One window, without shift: softmax(q kᵀ / √c + bias) v, head by head.
        block = self.block(False)
        tall, wide = WINDOW
        tokens = torch.randn(1, tall, wide, 16)
        flat = block.norm_attention(tokens).view(tall * wide, 16)
        query, key, value = block.attend(flat).split(16, -1)
        bias = torch.empty(tall * wide, tall * wide)
        for one in range(tall * wide):
            for other in range(tall * wide):
                down = one // wide - other // wide + tall - 1
                right = one % wide - other % wide + wide - 1
                bias[one, other] = block.bias[down * (2 * wide - 1) + right, 0]
        mixed = torch.softmax(query @ key.T / 16**0.5 + bias, -1) @ value
        expected = tokens + block.project(mixed).view(tokens.shape)
        expected = expected + block.perceptron(expected)
        torch.testing.assert_close(block(tokens), expected, rtol=1e-4, atol=1e-5)


def test_the_level_of_a_map_is_not_normalised_away() -> None:
    # How strong a frame is says how far the person is from the noise.
    values = torch.rand(1, 72, 32)
    for name in TRAINED:
        model = network(name)
        with torch.no_grad():
            faint, strong = (model(level * values) for level in (0.5, 1.0))
        assert (faint - strong).abs().max() > 1e-3, name


@pytest.mark.parametrize("name", ["s4", "s4d"])
def test_a_state_space_looks_both_ways_and_has_another_that_does_not(name: str) -> None:
    model = build(name, **(SMALL[name] | {"bidirectional": True})).eval()
    live = model.live
    assert live is not None
    assert live.causal
    assert not model.causal
    values = torch.rand(1, 300, 32)
    other = values.clone()
    other[:, 250:] = torch.rand(1, 50, 32)
    with torch.no_grad():
        torch.testing.assert_close(live(values)[:, :250], live(other)[:, :250])
        assert not torch.allclose(model(values)[:, :250], model(other)[:, :250])
    parameters = {id(one) for one in model.ssm_parameters()}
    assert len(parameters) == sum(1 for part in (model.whole, live) for _ in part.ssm_parameters())
    lone = build(name, **(SMALL[name] | {"bidirectional": True, "live": False}))
    assert lone.live is None


@pytest.mark.parametrize("name", TRAINED)
@pytest.mark.parametrize(("parts", "more"), [(1, 0), (3, 0), (1, 93)])
def test_a_network_corrects_a_linear_map_of_the_frame(name: str, parts: int, more: int) -> None:
    model = build(name, 32, parts, more, **SMALL[name]).eval()
    values = torch.rand(2, 72, model.features)
    with torch.no_grad():
        for parameter in model.network.parameters():
            parameter.zero_()
        whole = values[..., : parts * 32].unflatten(-1, (parts, 32)).square().sum(-2).sqrt()
        torch.testing.assert_close(model(values), whole)


def test_sizes_are_comparable() -> None:
    alone = {"s4": {"bidirectional": False}, "s4d": {"bidirectional": False}}
    counts = {name: parameter_count(build(name, **alone.get(name, {}))) for name in MODELS}
    assert max(counts.values()) < 1.35 * min(counts.values()), counts


@pytest.mark.parametrize("name", [*MODELS, *FILTERS])
def test_every_model_says_what_it_is(name: str) -> None:
    assert summary(name)


@pytest.mark.parametrize(
    ("name", "given", "words"),
    [
        ("gpt", {}, "no model 'gpt'"),
        ("gru", {"width": 3}, "no option 'width'"),
        ("gru", {"channels": 0}, "channels is 0"),
        ("gru", {"channels": 2.5}, "channels is 2.5"),
        ("gru", {"channels": True}, "channels is True"),
        ("gru", {"dropout": 1.0}, "dropout is 1.0"),
        ("s4", {"bidirectional": 1}, "bidirectional is 1"),
        ("s4", {"dt_min": 0.0}, "dt_min is 0.0"),
        ("s4d", {"dt_max": 1e9}, "dt_max is 1000000000.0"),
        ("s4", {"dt_max": "slow"}, "dt_max is 'slow'"),
        ("s4-serial", {"dt_min": 0.5, "dt_max": 0.2}, "dt_min = 0.5 to dt_max = 0.2"),
        ("none", {"channels": 8}, "no option 'channels'"),
    ],
)
def test_what_cannot_be_built(name: str, given: dict, words: str) -> None:
    with pytest.raises(Sd2Error, match=words):
        build(name, **given)


@pytest.mark.parametrize("bins", [0, 10**6, 10**30])
def test_no_model_is_made_of_more_bins_than_a_map_has(bins: int) -> None:
    """A damaged file may ask for any number."""
    with pytest.raises(Sd2Error, match="from 1 to 65,536 bins"):
        build("gru", bins)
