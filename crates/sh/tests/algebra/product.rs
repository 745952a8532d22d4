use halflight_sh::{Sh, reference};

use crate::common::{Numbers, largest_difference};

fn against_quadrature<const N: usize>() {
    let mut numbers = Numbers(2);
    for _ in 0..3 {
        let (f, g): (Sh<N, f64>, Sh<N, f64>) = (numbers.sh(), numbers.sh());
        let mut product = Sh::<N, f64>::zero();
        for (d, weight) in reference::sphere_quadrature(2 * N) {
            product += Sh::basis(d) * (weight * f.at(d) * g.at(d));
        }
        assert!(largest_difference(&product, &f.product(&g)) < 1e-12, "order {N}");
        let single = f.cast().product(&g.cast()).cast();
        assert!(largest_difference(&product, &single) < 1e-5, "order {N} in f32");
        assert!(largest_difference(&f.square(), &f.product(&f)) < 1e-13, "order {N}");
        assert!(largest_difference(&f.product_matrix().apply(&g), &f.product(&g)) < 1e-13, "order {N}");
        assert!(largest_difference(&f.product_matrix().apply(&Sh::one()), &f) < 1e-13, "order {N}");
        let h = numbers.sh();
        assert!((f.triple_product(&g, &h) - h.triple_product(&f, &g)).abs() < 1e-12);
    }
}

#[test]
fn products_equal_quadrature_at_every_order() {
    against_quadrature::<1>();
    against_quadrature::<2>();
    against_quadrature::<3>();
    against_quadrature::<4>();
    against_quadrature::<5>();
    against_quadrature::<6>();
    against_quadrature::<7>();
    against_quadrature::<8>();
}

#[test]
fn truncated_products_commute_and_do_not_associate() {
    let mut numbers = Numbers(3);
    let (f, g, h): (Sh<4, f64>, Sh<4, f64>, Sh<4, f64>) = (numbers.sh(), numbers.sh(), numbers.sh());
    assert!(largest_difference(&f.product(&g), &g.product(&f)) < 1e-14);
    assert!(largest_difference(&f.product(&g).product(&h), &f.product(&g.product(&h))) > 1e-3);
}
