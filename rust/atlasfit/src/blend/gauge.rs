//! Which side is positive in one block.
//!
//! In: the block's charts and how charts relate. Out: a sign for each of them. Where the charts' global signs
//! contradict each other, as they must on a one-sided surface, the signs within the block are spread anew
//! over the relations there, strongest first (a maximum spanning tree; Kruskal 1956).

use crate::atlas::{Chart, Relation};

/// How two charts of a block, by their places in its list, stand to each other.
struct Link {
    agreement: f64,
    ends: (usize, usize),
}

/// Signs of a block's charts, 1 or -1: the global ones, unless `contradicted` says that some of them
/// contradict each other; then they are spread over the relations within the block. `list` ascends;
/// `relations` ascend by their first chart.
pub(super) fn signs(charts: &[Chart], relations: &[Relation], contradicted: bool, list: &[u32]) -> Vec<f64> {
    let mut signs: Vec<f64> = list.iter().map(|&c| charts[c as usize].sign).collect();
    if contradicted {
        spread(&mut signs, links_among(relations, list));
    }
    signs
}

/// The relations among the charts of a list.
fn links_among(relations: &[Relation], list: &[u32]) -> Vec<Link> {
    let mut links = Vec::new();
    for (i, &a) in list.iter().enumerate() {
        let from = relations.partition_point(|r| r.a < a);
        for r in relations[from..].iter().take_while(|r| r.a == a) {
            if let Ok(j) = list.binary_search(&r.b) {
                links.push(Link { agreement: r.agreement, ends: (i, j) });
            }
        }
    }
    links
}

/// Joins groups of charts by their links, strongest first, and flips the later group where the link asks for
/// it. A few dozen charts: groups are plain labels.
fn spread(signs: &mut [f64], mut links: Vec<Link>) {
    links.sort_by(|x, y| y.agreement.abs().total_cmp(&x.agreement.abs()).then(x.ends.cmp(&y.ends)));
    let mut group: Vec<usize> = (0..signs.len()).collect();
    for Link { agreement, ends: (i, j) } in links {
        let (gi, gj) = (group[i], group[j]);
        if gi == gj {
            continue;
        }
        let flip = agreement * signs[i] * signs[j] < 0.0;
        for k in 0..signs.len() {
            if group[k] == gj {
                group[k] = gi;
                if flip {
                    signs[k] = -signs[k];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weakest_link_of_a_contradictory_ring_gives_way() {
        // Three charts in a ring: two links say alike, the third and weakest says opposite.
        let link = |agreement, i, j| Link { agreement, ends: (i, j) };
        let mut signs = [1.0, -1.0, 1.0];
        spread(&mut signs, vec![link(5.0, 0, 1), link(4.0, 1, 2), link(-3.0, 0, 2)]);
        assert!(signs[0] == signs[1] && signs[1] == signs[2]);
    }
}
